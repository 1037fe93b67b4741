"""What sensors' tolerances add to the uncertainty of a fit."""

from dataclasses import replace

import numpy as np
import pytest

from rippletwin.calibration.frequency_continuation import refine
from rippletwin.calibration.laplace import gradient_and_hessian
from rippletwin.calibration.posterior import Posterior
from rippletwin.explanation.checks.sensor_tolerance import (
    GAIN_SD,
    LAG_SD,
    add_sensor_tolerance,
    sensor_changes,
)
from rippletwin.explanation.thresholds import LITTLE_MODEL_ERROR
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.twin import Twin
from synthetic_observations import make

DELAY = ((EFFECTS["sensor_delay"], Place("sensor p2", 1)),)
VALUES = {"sensor_delay@sensor p2.delay": 4e-5}
MODULE = "rippletwin.explanation.checks.sensor_tolerance"
NAME = "sensor_delay@sensor p2.delay"


@pytest.fixture(scope="module")
def fitted():
    """(fit from the truth of a line whose second sensor lags, observations)."""
    bench, observations, truth = make(np.random.default_rng(4), DELAY, VALUES)
    return refine(Twin(bench, observations), DELAY, observations, [truth.theta]), observations


def test_changes_are_difference_quotients_of_gains_and_lags():
    """Proves the derivatives: readings multiplied by 1 + g and exp(-j w t) change by them."""
    rng = np.random.default_rng(1)
    prediction = rng.normal(size=(2, 3, 2)) @ np.array([1.0, 1j])
    frequency_hz = np.array([100.0, 1000.0, 3000.0])
    changes = sensor_changes(prediction, frequency_hz)
    for sensor in range(2):
        moved = prediction.copy()
        moved[sensor] *= 1.0 + GAIN_SD
        np.testing.assert_allclose(changes[sensor], moved - prediction, atol=1e-12)
        turned = prediction.copy()
        turned[sensor] *= np.exp(-2j * np.pi * frequency_hz * 1e-4 * LAG_SD)
        np.testing.assert_allclose(changes[2 + sensor], 1e4 * (turned - prediction), rtol=1e-4)


def test_the_delay_of_a_sensor_is_known_to_the_lag_of_the_others(fitted):
    """Proves the size: a delay is a difference between sensors, so with the tolerance its standard
    deviation is at least that of its own lag, and at most that of three lags; without, it is a
    fraction of one. No parameter is better known than before, and no value moves."""
    fit, observations = fitted
    wide = add_sensor_tolerance(fit, observations)
    k = fit.twin.index[NAME]
    parameter = fit.twin.parameters[k]

    def sd(each):
        return parameter.value_sd(each.twin.theta[k], each.sd[k])

    assert sd(fit) < 0.5 * LAG_SD
    assert LAG_SD < sd(wide) < 3.0 * LAG_SD
    assert np.all(wide.sd >= fit.sd * (1.0 - 1e-6))
    assert np.array_equal(wide.twin.theta, fit.twin.theta)


def test_interval_ends_grow_on_either_side(fitted):
    """Proves that the tolerances' variance is added to that of either end of a traced interval,
    whichever is the sharper, as independent errors are."""
    fit, observations = fitted
    k, theta = fit.twin.index[NAME], fit.twin.theta
    ends = (theta[k] - fit.sd[k], theta[k] + 3.0 * fit.sd[k])
    wide = add_sensor_tolerance(replace(fit, interval_ends={k: ends}), observations)
    added = 1.96 * np.sqrt(wide.sd[k] ** 2 - fit.sd[k] ** 2)
    for old, new in zip(ends, wide.interval_ends[k]):
        assert abs(new - theta[k]) == pytest.approx(np.hypot(old - theta[k], added), rel=0.01)
        assert (new > theta[k]) == (old > theta[k])


def test_a_good_fit_is_known_as_with_a_little_model_error(fitted, monkeypatch):
    """Proves the allowance against the Hessian at that model error: a fit that leaves less has its
    standard deviations, and one that leaves more keeps its own."""
    fit, observations = fitted
    assert fit.model_error < 0.5 * LITTLE_MODEL_ERROR
    monkeypatch.setattr(f"{MODULE}.GAIN_SD", 0.0)
    monkeypatch.setattr(f"{MODULE}.LAG_SD", 0.0)
    posterior, theta = Posterior(fit.twin, observations), fit.twin.theta
    prediction = posterior.predict(theta)
    posterior.estimate_errors(prediction, theta)
    posterior.model_error = LITTLE_MODEL_ERROR
    hessian = gradient_and_hessian(posterior, theta, prediction)[1]
    expected = np.sqrt(np.diag(np.linalg.inv(hessian)))
    wide = add_sensor_tolerance(fit, observations)
    np.testing.assert_allclose(wide.sd, expected, rtol=0.02)
    assert np.max(wide.sd / fit.sd) > 1.5
    monkeypatch.setattr(f"{MODULE}.LITTLE_MODEL_ERROR", 0.5 * fit.model_error)
    same = add_sensor_tolerance(fit, observations)
    np.testing.assert_allclose(same.sd, fit.sd, rtol=1e-3)


def test_a_source_free_fit_stays(fitted):
    """Proves that a fit to which the tolerances do not apply is returned as it is."""
    fit, observations = fitted
    free = replace(fit, source_free=True)
    assert add_sensor_tolerance(free, observations) is free
