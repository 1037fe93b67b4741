"""The way down to a posterior mode, and the curvature there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rippletwin.calibration.posterior import Posterior

CONVERGED = 1e-2  # change of minus the log posterior: evidence is judged in whole units
REACH = 1.5  # longest step of a coordinate, in prior standard deviations


def descend(
    posterior: Posterior,
    theta: np.ndarray,
    max_steps: int,
    held: Sequence[int] = (),
    errors: bool = True,
    converged: float = CONVERGED,
):
    """Levenberg-Marquardt: theta (P,) and minus the log posterior. Parameters with the indices
    `held` stay; the posterior's errors are estimated on the way unless `errors` is false. A step
    that gains less than `converged` is the last."""
    free = np.setdiff1d(np.arange(len(theta)), held)
    prediction = posterior.predict(theta)
    if not posterior.is_valid(prediction):
        return theta, np.inf  # no way leads down from there
    if errors:
        posterior.estimate_errors(prediction, theta)
    value = posterior.objective(theta, prediction)
    damping = 1e-2
    for _ in range(max_steps):
        r, jacobian = posterior.linearise(theta, prediction)
        jacobian = jacobian[:, free]
        gradient, hessian = jacobian.T @ r, jacobian.T @ jacobian
        scale = np.maximum(np.diag(hessian), 1e-6)
        accepted = False
        while damping < 1e6:
            step = -np.linalg.solve(hessian + np.diag(damping * scale), gradient)
            new = theta.copy()
            new[free] += np.clip(step, -REACH, REACH)
            new_prediction = posterior.predict(new)
            new_value = posterior.objective(new, new_prediction)
            if new_value < value:
                accepted = True
                break
            damping *= 6.0
        if not accepted:
            break
        damping = max(damping / 8.0, 1e-9)
        theta, prediction = new, new_prediction
        if errors:
            posterior.estimate_errors(prediction, theta)
        last, value = value, min(new_value, posterior.objective(theta, prediction))
        if last - value < converged:
            break
    return theta, value


def hessian(posterior: Posterior, theta: np.ndarray, prediction: np.ndarray) -> np.ndarray:
    """Of minus the log posterior (P, P), to first order in the prediction."""
    jacobian = posterior.linearise(theta, prediction)[1]
    second = jacobian.T @ jacobian
    # Shaft angles have no prior. Blind to the source they have no say either, hence the 1.
    flat = ~posterior.prior
    second[flat, flat] += 1.0 if posterior.source_free else 1e-9
    return second
