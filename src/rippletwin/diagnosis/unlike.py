"""Whether a recording is like any state that was tried, and if not, where it differs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import gammaincc

from rippletwin.diagnosis.evidence import CHANGES, SCATTERS, ErrorPrior, StateEvidence
from rippletwin.diagnosis.observation_model import ALIKE, Errors, ObservationModel

UNLIKE = 0.01  # p-value below which a recording is like nothing that was tried
STANDS_OUT = 3.0  # residual over its expected error, of an order worth naming
MOST_ORDERS = 12
COHERENT = 0.7  # share of the residual that one flow at the pump must account for
ONE_SENSOR = 0.9  # share of the residual at one sensor that makes it that sensor's


@dataclass(frozen=True)
class Unlikeness:
    """p_value of the best state; shaft orders and element where the residual stands out."""

    p_value: float
    orders: tuple[int, ...] = ()
    element: str | None = None

    @property
    def unlike(self) -> bool:
        return self.p_value < UNLIKE


def judge_residual(model: ObservationModel, best: StateEvidence, prior: ErrorPrior) -> Unlikeness:
    """How often errors as the prior has them leave as large a residual as the best state does, or
    make the line drift as far: the smaller of the two probabilities.

    A line whose state must drift further than oil and load can is another line. Either test alone
    calls one in a hundred of the recordings unlike that are not.
    """
    model.linearise_line(best.mode)
    drift = best.mode.drift
    of_drift = float(gammaincc(0.5 * len(drift), 0.5 * np.sum(drift**2))) if len(drift) else 1.0
    p = min(_of_residual(model, best, prior), of_drift)
    if p >= UNLIKE:
        return Unlikeness(p)
    parts = model.parts(best.mode)
    residual = model.values - model.expected_reading(parts, best.errors)
    usual = model.variance(parts, Errors(prior.scatter, prior.change))
    orders, element = _where(model, residual, usual)
    return Unlikeness(p, orders, "line" if p == of_drift else element)


def _of_residual(model: ObservationModel, best: StateEvidence, prior: ErrorPrior) -> float:
    """The probability of a residual as large as the best state's.

    The residual is measured in the errors of the prior's medians, the adjustments made to the line
    counted in. What it would be under larger and smaller errors is a gamma distribution of that
    mean, whose freedom allows for residuals that go together.
    """
    medians, parts = Errors(prior.scatter, prior.change), model.parts(best.mode)
    misfit = model.evaluate(best.mode, medians).square
    usual = model.variance(parts, medians)
    count = 2.0 * usual.size
    chances = np.exp(prior.log_weights())
    p = 0.0
    for i, scatter in enumerate(SCATTERS):
        for k, change in enumerate(CHANGES):
            errors = Errors(float(scatter), float(change))
            ratio = float(np.mean(model.variance(parts, errors) / usual))
            freedom = count / ALIKE / 2.0
            p += chances[i, k] * gammaincc(freedom, freedom * misfit / (count * ratio))
    return float(p)


def _where(model: ObservationModel, residual, variance) -> tuple[tuple[int, ...], str | None]:
    size = np.sqrt(np.mean(np.abs(residual) ** 2 / variance, axis=0))
    largest = np.argsort(-size)[:MOST_ORDERS]
    orders = sorted(int(model.orders[k]) for k in largest if size[k] > STANDS_OUT)
    return tuple(orders), _element(model, residual, variance)


def _element(model: ObservationModel, residual, variance) -> str | None:
    """ "source" where one flow at the pump accounts for all sensors, the sensor that has nearly all
    of the residual, or "line"; None for a single sensor, which cannot tell."""
    sensors = len(residual)
    if sensors < 2:
        return None
    response = model.line.response()[:, : len(model.orders)]
    weight = 1.0 / variance
    flow = np.sum(weight * np.conj(response) * residual, 0) / np.sum(
        weight * np.abs(response) ** 2, 0
    )
    by_sensor = np.sum(weight * np.abs(residual) ** 2, axis=1)
    left = np.sum(weight * np.abs(residual - response * flow) ** 2)
    # One flow takes one in `sensors` of any residual.
    coherent = 1.0 - left / by_sensor.sum() * sensors / (sensors - 1)
    if coherent > COHERENT:
        return "source"
    if by_sensor.max() > ONE_SENSOR * by_sensor.sum():
        return f"sensor {model.line.twin.rig.sensors[int(np.argmax(by_sensor))].name}"
    return "line"
