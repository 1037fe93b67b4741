"""Laplace's approximation at and beside a mode."""

import numpy as np
import pytest

from rippletwin.calibration.frequency_continuation import refine
from rippletwin.calibration.laplace import UNCONVERGED_GAIN, gradient_and_hessian
from rippletwin.calibration.posterior import Posterior
from rippletwin.twin.twin import Twin
from synthetic_observations import POINTS, make


@pytest.fixture(scope="module")
def fitted():
    rig, observations, truth = make(np.random.default_rng(3), points=POINTS[:1])
    fit = refine(Twin(rig, observations), (), observations, [truth.theta])
    return fit, Posterior(fit.twin, observations)


def test_a_mode_promises_nothing_more(fitted):
    """The descent has ended at a stationary point: a Newton step promises far less than what
    decides between explanations."""
    fit, _ = fitted
    assert 0.0 <= fit.expected_gain < 0.1 * UNCONVERGED_GAIN


def test_beside_the_mode_the_promise_is_what_the_descent_gains(fitted):
    """Four posterior standard deviations from the mode, in a random direction, the step promises
    the gain of log posterior that going back has at the same errors, to a tenth."""
    fit, model = fitted
    direction = np.linalg.cholesky(fit.covariance) @ np.random.default_rng(1).normal(
        size=len(fit.twin.theta)
    )
    theta = fit.twin.theta + 4.0 * direction / np.sqrt(
        direction @ np.linalg.solve(fit.covariance, direction)
    )
    prediction = model.predict(fit.twin.theta)
    model.estimate_errors(prediction, fit.twin.theta)
    at_mode = model.objective(fit.twin.theta, prediction)
    gained = model.objective(theta, model.predict(theta)) - at_mode
    gradient, hessian = gradient_and_hessian(model, theta, model.predict(theta))
    promised = 0.5 * float(gradient @ np.linalg.solve(hessian, gradient))
    assert promised == pytest.approx(gained, rel=0.1)
    assert gained > 4.0
