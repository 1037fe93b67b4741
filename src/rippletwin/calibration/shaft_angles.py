"""Alignment of the shaft angles: recordings have no tachometer."""

from __future__ import annotations

import numpy as np

from rippletwin.calibration.error_model import ErrorModel, Prediction
from rippletwin.calibration.levenberg_marquardt import descend

ANGLES_PER_TURN = 16  # points of the grid in a turn of the highest order
REFINING_STEPS, REFINED = 6, 1e-9  # most steps after the grid, and gain of the last


def align_shaft_angles(
    model: ErrorModel,
    theta: np.ndarray,
    between: bool = False,
    prediction: Prediction | None = None,
) -> tuple[float, np.ndarray]:
    """Relative misfit, and theta (P,) with each recording's shaft angle aligned on a grid.

    between      whether the angle is then moved between the points of the grid
    prediction   at theta, if it is known

    An angle turns order k by k times itself. The grid covers one turn of the orders' greatest
    common divisor. Each frequency weighs as the relative model error has it. The misfit is the
    mean square of the residuals over that weight, infinite where the prediction is.
    """
    theta, twin = np.array(theta), model.twin
    parts = model.by_observation(model.predict(theta) if prediction is None else prediction)
    if not all(np.all(np.isfinite(part.predicted)) for part in parts):
        return np.inf, theta
    misfit, count = 0.0, 0
    for o, (measured, predicted, power) in zip(model.observations, parts):
        count += measured.size
        left, whole = (np.sum(np.abs(x) ** 2, axis=0) / power for x in (measured, predicted))
        weighted = np.sum(np.conj(predicted) * measured, axis=0) / power
        if o.source == "free":  # at its most likely amplitude
            left = left - np.abs(weighted) ** 2 / np.maximum(whole, 1e-300)
            misfit += float(np.sum(left))
            continue
        known = o.source == "known"
        match = np.sum(weighted.real if known else np.abs(weighted))  # else its phase is free
        index = twin.index.get(f"angle[{o.label}]")
        if index is not None and not model.source_free:
            orders = np.asarray(o.orders, int)
            order = np.gcd.reduce(orders)
            turn, match = find_best_turn(weighted, orders, between)
            parameter = twin.parameters[index]
            angle = parameter.value(theta[index]) + turn
            angle = (angle + np.pi / order) % (2 * np.pi / order) - np.pi / order
            theta[index] = parameter.prior.coordinate(angle)
        misfit += float(np.sum(left + whole) - 2 * match)
    return misfit / count, theta


def find_best_turn(
    weighted: np.ndarray, orders: np.ndarray, between: bool = True
) -> tuple[float, float]:
    """Angle where Re sum_k weighted_k exp(-j k angle) is greatest, and the maximum.

    weighted   (F,) conjugate prediction times measurement, at shaft orders (F,), ascending
    between    whether the angle is moved between the points of a grid

    The prediction agrees best with the measurement when order k is multiplied by exp(j k angle).
    """
    order = np.gcd.reduce(orders)
    lines = np.zeros(ANGLES_PER_TURN * orders[-1] // order, complex)
    lines[orders // order] = weighted
    matches = np.fft.fft(lines).real
    turn = 2 * np.pi * np.argmax(matches) / (len(lines) * order)
    if between:
        return _maximise_match(weighted, orders, turn)
    return turn, float(np.max(matches))


def _maximise_match(weighted: np.ndarray, orders: np.ndarray, turn: float) -> tuple[float, float]:
    """Angle near `turn` where Re sum_k weighted_k exp(-j k angle) is greatest, and the maximum.

    Three steps of Newton's method suffice from the best point of the grid.
    """
    for _ in range(3):
        turned = weighted * np.exp(-1j * orders * turn)
        curvature = np.sum(orders**2 * turned.real)
        if curvature <= 0.0:
            break
        turn += np.sum(orders * turned.imag) / curvature
    return turn, float(np.sum((weighted * np.exp(-1j * orders * turn)).real))


def fit_shaft_angles(model: ErrorModel, theta: np.ndarray) -> np.ndarray:
    """theta (P,) with the shaft angles fitted, all else and the errors of `model` fixed.

    Only the angles of the recordings in `model` move.
    """
    labels = [f"angle[{o.label}]" for o in model.observations]
    angles = [model.twin.index[name] for name in labels if name in model.twin.index]
    if not angles or model.source_free:
        return theta
    theta = align_shaft_angles(model, theta)[1]
    others = np.setdiff1d(np.arange(len(theta)), angles)
    return descend(model, theta, REFINING_STEPS, others, errors=False, converged=REFINED)[0]
