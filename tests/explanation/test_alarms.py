"""The alarms: drift between the halves of a recording, and the largest pull."""

from dataclasses import replace

import numpy as np

from rippletwin.calibration.frequency_continuation import refine
from rippletwin.explanation.checks.alarms import drift_p_value, largest_pull
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.twin import Twin
from synthetic_observations import make


def test_drift_is_reported_and_noise_is_not():
    """Two noisy halves of one state agree. Halves of states with a wave speed 3 % apart do not."""
    rng = np.random.default_rng(9)
    _, early, truth = make(rng, source=0.0)

    def half(theta):
        values = ForwardModel(truth, early)(theta)
        noise = [rng.normal(size=(*h.shape, 2)) @ np.array([1, 1j]) / np.sqrt(2) for h in values]
        sds = [np.sqrt(o.covariance[0, 0, 0].real) for o in early]
        return [replace(o, values=h + sd * e) for o, h, sd, e in zip(early, values, sds, noise)]

    changed = truth.theta.copy()
    changed[truth.index["wave_speed[1]"]] += 0.5
    delay = sum(s.delay for s in truth.rig.line)
    assert drift_p_value(early, half(truth.theta), delay)[0] > 0.01
    assert drift_p_value(early, half(changed), delay)[0] < 1e-6


def test_largest_pull_names_the_parameter():
    """The largest pull is that of the parameter farthest from the data sheet."""
    bench, observations, truth = make(np.random.default_rng(10))
    fit = refine(Twin(bench, observations), (), observations, [truth.theta])
    theta = np.zeros_like(fit.twin.theta)
    theta[fit.twin.index["diameter[2]"]] = -5.0
    moved = replace(fit, twin=fit.twin.with_(theta=theta))
    assert largest_pull(moved) == (5.0, "diameter[2]")
