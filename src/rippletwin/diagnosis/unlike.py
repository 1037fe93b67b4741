"""Whether a recording is like any state that was tried, and if not, where it differs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import gammaincc

from rippletwin.diagnosis.division import ACROSS, ALONG
from rippletwin.diagnosis.evidence import CHANGES, SCATTERS, ErrorPrior, StateEvidence
from rippletwin.diagnosis.hypothesis import Errors
from rippletwin.diagnosis.observation_model import ALIKE, ObservationModel

UNLIKE = 0.01  # p-value below which a recording is like nothing that was tried
STANDS_OUT = 3.0  # residual over its expected error, of an order worth naming
MOST_ORDERS = 12
ONE_SENSOR = 0.9  # share of the residual at one sensor that makes it that sensor's


@dataclass(frozen=True)
class Unlikeness:
    """p_value of the best state; shaft orders and element where the residual stands out."""

    p_value: float
    orders: tuple[int, ...] = ()
    element: str | None = None

    @property
    def unlike(self) -> bool:
        """Whether the recording is unlike everything that was tried."""
        return self.p_value < UNLIKE


def judge_residual(model: ObservationModel, best: StateEvidence, prior: ErrorPrior) -> Unlikeness:
    """How often errors as the prior has them leave as large a residual as the best state does.

    Two tests. Of the pump: what one flow accounts for. Of the line: what none does, and how far its
    state has to drift, together. A line whose state must drift further than oil and load can is
    another line. The p-value is that of both tests: one in a hundred of the recordings that are
    like a state is called unlike.
    """
    model.linearise_line(best.mode)
    of_pump, of_line = _of_residual(model, best, prior, ALONG), _of_line(model, best, prior)
    p = smaller_of_two(of_pump, of_line)
    if p >= UNLIKE:
        return Unlikeness(p)
    parts = model.predict(best.mode)
    residual = model.values - model.expected_reading(parts, best.errors)
    usual = model.variance(parts, Errors(prior.scatter, prior.change))
    size = np.sqrt(np.mean(np.abs(residual) ** 2 / usual, axis=0))
    largest = np.argsort(-size)[:MOST_ORDERS]
    orders = sorted(int(model.orders[k]) for k in largest if size[k] > STANDS_OUT)
    return Unlikeness(p, tuple(orders), _element(model, residual, usual, of_pump, of_line))


def smaller_of_two(one: float, other: float) -> float:
    """The p-value of the smaller one of two independent p-values (Sidak 1967, J. Am. Stat. Assoc.
    62, 626): the probability that the smaller of two uniform random numbers in [0, 1] is as small.
    """
    return float(-np.expm1(2.0 * np.log1p(-min(one, other, 1.0 - 1e-16))))


def combine(one: float, other: float) -> float:
    """The p-value of two independent tests together (Fisher 1932, Statistical Methods for Research
    Workers, section 21.1): the probability that the product of two uniform random numbers in
    [0, 1] is as small as theirs."""
    product = one * other
    return float(product * (1.0 - np.log(product))) if product > 0.0 else 0.0


def _of_line(model: ObservationModel, best: StateEvidence, prior: ErrorPrior) -> float:
    """The probability of what no flow explains, and of the drift in its standard deviations."""
    drift = best.mode.drift
    drifted = float(gammaincc(0.5 * len(drift), 0.5 * np.sum(drift**2)))
    if model.sensors == 1:
        return drifted
    return combine(drifted, _of_residual(model, best, prior, ACROSS))


def _of_residual(
    model: ObservationModel, best: StateEvidence, prior: ErrorPrior, part: slice
) -> float:
    """The probability of a residual as large as the best state's in a part of the readings.

    The residual is measured in the errors of the prior's medians, the adjustments made to the line
    counted in. What it would be under larger and smaller errors is a gamma distribution of that
    mean, whose freedom allows for residuals that go together.
    """
    medians, parts = Errors(prior.scatter, prior.change), model.predict(best.mode)
    misfit = model.evaluate(best.mode, medians, part=part).square
    usual = model.variance(parts, medians)[part]
    count = 2.0 * usual.size
    chances = np.exp(prior.log_weights())
    p = 0.0
    for i, scatter in enumerate(SCATTERS):
        for k, change in enumerate(CHANGES):
            errors = Errors(float(scatter), float(change), across=float(change))
            ratio = float(np.mean(model.variance(parts, errors)[part] / usual))
            freedom = count / ALIKE / 2.0
            p += chances[i, k] * gammaincc(freedom, freedom * misfit / (count * ratio))
    return float(p)


def _element(model: ObservationModel, residual, variance, of_pump, of_line) -> str | None:
    """ "source" where what one flow at the pump accounts for is unlike, the sensor that has nearly
    all of the residual, or "line". A single sensor tells the line by its drift alone: None where
    the residual is unlike."""
    if of_pump < of_line:
        return "source" if model.sensors > 1 else None
    at_sensors = model.division.at_sensors(residual)
    by_sensor = np.sum(np.abs(at_sensors) ** 2 / np.mean(variance, axis=0), axis=1)
    if model.sensors > 1 and by_sensor.max() > ONE_SENSOR * by_sensor.sum():
        return f"sensor {model.observation.sensors[int(np.argmax(by_sensor))].name}"
    return "line"
