"""Alarms of the base fit and of the two halves of a recording."""

from dataclasses import replace

import numpy as np

from rippletwin.calibration.frequency_continuation import refine
from rippletwin.explanation.checks.alarms import drift_p_value, largest_pull
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.twin import Twin
from synthetic_observations import make


def test_drift_is_detected_and_noise_is_not():
    """Two noisy recordings of one state agree. With a wave speed that differs by half its prior
    deviation they do not."""
    rng = np.random.default_rng(9)
    _, early, truth = make(rng, source=0.0)
    changed = truth.theta.copy()
    changed[truth.index["wave_speed[1]"]] += 0.5

    def record(theta):
        recorded = []
        for o, h in zip(early, ForwardModel(truth, early)(theta)):
            noise = rng.normal(size=(*h.shape, 2)) @ np.array([1, 1j]) / np.sqrt(2)
            recorded.append(replace(o, values=h + noise * np.sqrt(o.covariance[0, 0, 0].real)))
        return recorded

    assert drift_p_value(early, record(truth.theta), truth.rig.delay)[0] > 0.01
    assert drift_p_value(early, record(changed), truth.rig.delay)[0] < 1e-6


def test_the_pull_names_the_parameter_farthest_from_the_data_sheet():
    """Of a fit with one coordinate at -5 and all others at 0, that one is named, with 5."""
    bench, observations, truth = make(np.random.default_rng(10))
    fit = refine(Twin(bench, observations), (), observations, [truth.theta])
    theta = np.zeros_like(fit.twin.theta)
    theta[fit.twin.index["diameter[2]"]] = -5.0
    moved = replace(fit, twin=fit.twin.with_(theta=theta))
    assert largest_pull(moved) == (5.0, "diameter[2]")
