"""Laplace's approximation of the posterior around a mode: covariance and evidence."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rippletwin.calibration.error_model import ErrorModel, Prediction

FLAT_CURVATURE = 1e-9
"""Added for a parameter without a prior, on which the data may have no bearing."""
FLAT_CURVATURE_SOURCE_FREE = 1.0
"""The same where the source is projected out: the data have no bearing on the shaft angles."""


class Mode(NamedTuple):
    """A mode of the posterior and its surroundings.

    objective    minus the log posterior
    covariance   (P, P) of theta, the inverse Hessian
    evidence     log evidence
    """

    objective: float
    covariance: np.ndarray
    evidence: float


def laplace(model: ErrorModel, theta: np.ndarray) -> Mode:
    """Covariance and evidence at a mode theta (P,); sets the errors of `model` to those there.

        log Z = log posterior at the mode - 1/2 log det H,

    with H the Hessian of minus the log posterior in the same coordinates, priors included (MacKay
    2003, Information Theory, Inference, and Learning Algorithms, ch. 27). Where the prediction is
    not valid, the evidence is minus infinity and the covariance the prior's.
    """
    prediction = model.predict(theta)
    if not model.is_valid(prediction):
        return Mode(np.inf, np.eye(len(theta)), -np.inf)
    model.estimate_errors(prediction, theta)
    objective = model.objective(theta, prediction)
    second = hessian(model, theta, prediction)
    log_determinant = np.linalg.slogdet(second)[1]
    return Mode(objective, np.linalg.inv(second), -objective - 0.5 * log_determinant)


def hessian(model: ErrorModel, theta: np.ndarray, prediction: Prediction) -> np.ndarray:
    """Hessian (P, P) of minus the log posterior, to first order in the prediction."""
    jacobian = model.linearise(theta, prediction)[1]
    second = jacobian.T @ jacobian
    flat = ~model.prior
    second[flat, flat] += FLAT_CURVATURE_SOURCE_FREE if model.source_free else FLAT_CURVATURE
    return second
