"""Levenberg-Marquardt descent to a mode of the posterior, for both error models."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rippletwin.calibration.error_model import ErrorModel

CONVERGED = 1e-2  # change of minus the log posterior: evidence is compared in whole units
PROMISED_SHARE = 0.1
"""Of `converged`: a step is tried if the quadratic model promises at least this gain."""
MAX_STEP = 1.5  # longest step of a coordinate, in prior standard deviations
FIRST_DAMPING, MIN_DAMPING, MAX_DAMPING = 1e-2, 1e-9, 1e6  # relative to the Hessian's diagonal
DAMPING_RISE, DAMPING_FALL = 6.0, 8.0  # factors after a refused and after an accepted step
MIN_CURVATURE = 1e-6  # of a coordinate, in the damping term
OTHER_ERRORS_GAIN = 0.5  # of log posterior, by errors that are estimated anew: then it goes on


def descend(
    model: ErrorModel,
    theta: np.ndarray,
    max_steps: int,
    fixed: Sequence[int] | np.ndarray = (),
    errors: bool = True,
    converged: float = CONVERGED,
    damping: float = FIRST_DAMPING,
) -> tuple[np.ndarray, float]:
    """Mode near theta (P,) and minus the log posterior there; infinite where theta is not valid.

    fixed      indices of the parameters that stay
    errors     whether the errors of `model` are estimated again, near the last ones after each step
               and anew where it ends; if not, only its most likely source follows
    converged  gain of a step below which it is the last
    damping    of the first step, relative to the diagonal of the Hessian

    Method: Marquardt 1963, J. Soc. Ind. Appl. Math. 11:431.
    """
    free = np.setdiff1d(np.arange(len(theta)), fixed)
    prediction = model.predict(theta)
    if not model.is_valid(prediction):
        return theta, np.inf
    if errors:
        model.estimate_errors(prediction, theta)
    else:
        model.follow_source(prediction)
    value = model.objective(theta, prediction)
    for done in range(1, max_steps + 1):
        r, jacobian = model.linearise(theta, prediction)
        jacobian = jacobian[:, free]
        gradient, hessian = jacobian.T @ r, jacobian.T @ jacobian
        scale = np.maximum(np.diag(hessian), MIN_CURVATURE)
        accepted = False
        while damping < MAX_DAMPING:
            step = -np.linalg.solve(hessian + np.diag(damping * scale), gradient)
            step = np.clip(step, -MAX_STEP, MAX_STEP)
            if -step @ (gradient + 0.5 * hessian @ step) < PROMISED_SHARE * converged:
                break  # not even the quadratic model promises a gain
            new = theta.copy()
            new[free] += step
            new_prediction = model.predict(new)
            new_value = model.objective(new, new_prediction)
            if new_value < value:
                accepted = True
                break
            damping *= DAMPING_RISE
        gain = 0.0
        if accepted:
            damping = max(damping / DAMPING_FALL, MIN_DAMPING)
            theta, prediction, gain = new, new_prediction, value - new_value
            if errors:
                model.estimate_errors(prediction, theta, near=True)
            else:
                model.follow_source(prediction)
            value = model.objective(theta, prediction)
        if gain >= converged and done < max_steps:
            continue
        if not errors or not model.errors_follow:
            break
        # The errors have followed from those of the start, which may be far from the likeliest.
        model.estimate_errors(prediction, theta)
        before, value = value, model.objective(theta, prediction)
        if before - value < OTHER_ERRORS_GAIN:
            break
        damping = FIRST_DAMPING
    return theta, value
