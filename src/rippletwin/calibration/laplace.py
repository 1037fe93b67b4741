"""Laplace's approximation of the posterior around a mode: covariance and evidence."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rippletwin.calibration.error_model import ErrorModel, Prediction

FLAT_CURVATURE = 1e-9
"""Added for a parameter without a prior, on which the data may have no bearing."""
FLAT_CURVATURE_SOURCE_FREE = 1.0
"""The same where the source is projected out: the data have no bearing on the shaft angles."""


UNCONVERGED_GAIN = 3.0
"""Gain of log posterior that one more step promises, from which a fit has not converged: so much
decides between explanations."""


class Mode(NamedTuple):
    """A mode of the posterior and its surroundings.

    objective      minus the log posterior
    covariance     (P, P) of theta, the inverse Hessian
    evidence       log evidence
    expected_gain  what a Newton step from there promises to add to the log posterior: half the
                   square of Newton's decrement (Boyd and Vandenberghe 2004, Convex Optimization,
                   sec. 9.5.1), 0 at a stationary point
    """

    objective: float
    covariance: np.ndarray
    evidence: float
    expected_gain: float


def approximate_posterior(model: ErrorModel, theta: np.ndarray) -> Mode:
    """Covariance and evidence at a mode theta (P,); sets the errors of `model` to those there.

        log Z = log posterior at the mode - 1/2 log det H,

    with H the Hessian of minus the log posterior in the same coordinates, priors included (MacKay
    2003, Information Theory, Inference, and Learning Algorithms, ch. 27). Where the prediction is
    not valid, the evidence is minus infinity and the covariance the prior's.
    """
    prediction = model.predict(theta)
    if not model.is_valid(prediction):
        return Mode(np.inf, np.eye(len(theta)), -np.inf, np.inf)
    model.estimate_errors(prediction, theta)
    objective = model.objective(theta, prediction)
    gradient, second = gradient_and_hessian(model, theta, prediction)
    log_determinant = np.linalg.slogdet(second)[1]
    covariance = np.linalg.inv(second)
    gain = 0.5 * float(gradient @ covariance @ gradient)
    return Mode(objective, covariance, -objective - 0.5 * log_determinant, gain)


def gradient_and_hessian(
    model: ErrorModel, theta: np.ndarray, prediction: Prediction
) -> tuple[np.ndarray, np.ndarray]:
    """Gradient (P,) and Hessian (P, P) of minus the log posterior, to first order in the
    prediction."""
    residual, jacobian = model.linearise(theta, prediction)
    second = jacobian.T @ jacobian
    flat = ~model.prior
    second[flat, flat] += FLAT_CURVATURE_SOURCE_FREE if model.source_free else FLAT_CURVATURE
    return jacobian.T @ residual, second
