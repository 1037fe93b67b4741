"""What is too small to be found adds to the uncertainty of all parameters.

No fit has the small errors that every sensor has: a gain that is off by some tenths of a per cent,
and the lag of the passage and the cavity in front of it. They are too small to be found, and yet
each decides how well a gain or a delay of another sensor can be known, because only their
difference shows. Here they are parameters with a prior, integrated out to first order about the
fit: the covariance grows, the mode stays.

What else is left out and too small to be found is allowed for by a model error of at least
LITTLE_MODEL_ERROR, however good the fit: parameters that are there can fit a part of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rippletwin.calibration.fit import HALF_INTERVAL, Fit
from rippletwin.calibration.laplace import FLAT_CURVATURE
from rippletwin.calibration.posterior import Posterior
from rippletwin.explanation.thresholds import LITTLE_MODEL_ERROR

GAIN_SD = 0.003
"""Relative, of each sensor: data sheets of pressure transmitters state 0.25 to 0.5 % of span."""
LAG_SD = 3e-6
"""s, of each sensor. A passage and cavity that resonate at f with damping ratio z lag by z/(pi f)
below: 3.5 us for 0.1 and 9 kHz, the middle of what adapters have (docs/diagnosis_trial.md)."""


def add_sensor_tolerance(fit: Fit, observations: Sequence) -> Fit:
    """The fit with the covariance and the interval ends that sensors with tolerances, and a little
    model error, leave.

    A fit without sensors, of an unknown source, or with sensors whose sensitivity is a parameter
    stays as it is.
    """
    has_sensors = all(o.kind != "input_impedance" for o in observations)
    gains_are_free = fit.twin.rig.uncertainty.sensor_gain > 0.0
    if not has_sensors or gains_are_free or fit.source_free or not np.isfinite(fit.evidence):
        return fit
    posterior, theta = Posterior(fit.twin, observations), fit.twin.theta
    prediction = posterior.predict(theta)
    if not posterior.is_valid(prediction):
        return fit
    posterior.estimate_errors(prediction, theta)
    exact = _covariance(posterior, theta, prediction)
    posterior.model_error = max(posterior.model_error, LITTLE_MODEL_ERROR)
    changes = sensor_changes(prediction, posterior.forward.frequency_hz)
    wide = _covariance(posterior, theta, prediction, changes)
    added = HALF_INTERVAL * np.sqrt(np.maximum(np.diag(wide - exact), 0.0))

    def grown(k: int, end: float) -> float:
        away = end - theta[k]
        return float(theta[k] + np.copysign(np.hypot(away, added[k]), away))

    ends = {k: (grown(k, low), grown(k, high)) for k, (low, high) in fit.interval_ends.items()}
    return replace(fit, covariance=fit.covariance + wide - exact, interval_ends=ends)


def _covariance(posterior: Posterior, theta: np.ndarray, prediction: np.ndarray, changes=None):
    """Covariance (P, P) of theta at the present errors; `changes` (B, S, F) of the prediction have
    unit variance and are integrated out."""
    jacobian, count = posterior.linearise(theta, prediction, changes)[1], len(theta)
    hessian = jacobian.T @ jacobian
    flat = np.flatnonzero(~posterior.prior)
    hessian[flat, flat] += FLAT_CURVATURE
    besides = np.arange(count, len(hessian))
    hessian[besides, besides] += 1.0
    return np.linalg.inv(hessian)[:count, :count]


def sensor_changes(prediction: np.ndarray, frequency_hz: np.ndarray) -> np.ndarray:
    """Changes (2 S, S, F) of a prediction (S, F) by one standard deviation of each sensor's gain
    and lag."""
    each = np.eye(len(prediction))[:, :, None] * prediction
    lag = -2j * np.pi * np.asarray(frequency_hz) * LAG_SD
    return np.concatenate([GAIN_SD * each, lag * each])
