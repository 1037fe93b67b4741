"""How far a prediction is from a measurement: relative misfit and Theil's inequality coefficient.

Both are taken on the ripple alone (no mean) from its complex harmonics, which by Parseval is the
same as from the time signals over whole revolutions:

    relative misfit   |measured - predicted| / |measured|
    Theil's U         |measured - predicted| / (|measured| + |predicted|)

with |.| the norm over sensors, frequencies and recordings. Pressures and the reflection
coefficients of input impedances have one each; both together have their root mean square. U lies
between 0 (equal) and 1; it is U1 of Theil (1961), Economic Forecasts and Policy, 2nd ed., sec. 2.5,
the coefficient used to validate simulations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rippletwin.calibration.error_model import ErrorModel
from rippletwin.calibration.fit import Fit
from rippletwin.calibration.posterior import Posterior
from rippletwin.calibration.shaft_angles import find_best_turn, fit_shaft_angles
from rippletwin.spectra.corrected_ripple import CorrectedRipple

REFLECTION = "reflection"  # the name of an input impedance, which is of no sensor


@dataclass(frozen=True)
class Misfit:
    """Relative misfit and Theil's coefficient over everything and per sensor (by name)."""

    relative: float
    theil: float
    relative_by_sensor: dict[str, float]
    theil_by_sensor: dict[str, float]


def relative_misfit(measured: np.ndarray, predicted: np.ndarray) -> float:
    """|measured - predicted| / |measured| of arrays of one shape and unit."""
    return float(np.linalg.norm(measured - predicted) / np.linalg.norm(measured))


def theil_coefficient(measured: np.ndarray, predicted: np.ndarray) -> float:
    """Theil's U1, from 0 to 1, of arrays of one shape and unit; 0 where both vanish."""
    total = np.linalg.norm(measured) + np.linalg.norm(predicted)
    return float(np.linalg.norm(measured - predicted) / total) if total else 0.0


def measure_misfit(model: ErrorModel, theta: np.ndarray) -> Misfit:
    """Misfits of the observations of `model` at theta (P,).

    A free source gets its most likely amplitude at each frequency, so the misfit then is that of
    the ratios between sensors.
    """
    joined = readings_by_sensor(model, theta)
    pressures = [p for name, p in joined.items() if name != REFLECTION]
    quantities = [[np.concatenate(x) for x in zip(*pressures)]] if pressures else []
    quantities += [joined[REFLECTION]] if REFLECTION in joined else []
    return Misfit(
        root_mean_square([relative_misfit(*q) for q in quantities]),
        root_mean_square([theil_coefficient(*q) for q in quantities]),
        {name: relative_misfit(*p) for name, p in joined.items()},
        {name: theil_coefficient(*p) for name, p in joined.items()},
    )


def readings_by_sensor(model: ErrorModel, theta: np.ndarray) -> dict[str, list[np.ndarray]]:
    """What was measured and what is predicted at theta (P,), (N,) each, of all observations by
    sensor, `REFLECTION` for input impedances. A free source has its most likely amplitude."""
    pairs: dict[str, list] = {}
    for o, (measured, h, _) in zip(model.observations, model.by_observation(model.predict(theta))):
        h = with_likely_amplitude(o, h, measured)
        for name, v, x in zip(_names(o), measured, h):
            pairs.setdefault(name, []).append((v, x))
    return {name: [np.concatenate(x) for x in zip(*p)] for name, p in pairs.items()}


def root_mean_square(values: Sequence[float]) -> float:
    """Of misfits of several quantities or parts of the data."""
    return float(np.sqrt(np.mean(np.square(values))))


def with_likely_amplitude(observation, predicted: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """The prediction (S, F) of an observation; that of a free source has the amplitude at each
    frequency that comes nearest to what was measured (S, F)."""
    if observation.source != "free":
        return predicted
    match = np.sum(np.conj(predicted) * measured, axis=0)
    return predicted * (match / np.sum(np.abs(predicted) ** 2, axis=0))


def _names(observation) -> list[str]:
    if observation.kind == "input_impedance":
        return [REFLECTION]
    return [getattr(s, "name", s) for s in observation.sensors]


@dataclass(frozen=True)
class Score:
    """Relative complex misfit and Theil's coefficient."""

    misfit: float
    theil: float


def score_fit(
    fit: Fit, observations: Sequence, turn: bool = False, ripple: CorrectedRipple | None = None
) -> Score:
    """Misfits of a fit's predictions; free sources get their most likely amplitude.

    turn     whether the shaft angles are fitted first; every recording has its own
    ripple   corrects the nominal flow ripple of the pump; None to take it as it is
    """
    posterior = Posterior(fit.twin, observations, None, fit.source_free)
    posterior.model_error, posterior.source_sd = fit.model_error, fit.source_sd
    theta = fit.twin.theta
    if turn:
        theta = fit_shaft_angles(posterior, theta)
    h = posterior.best_source(posterior.predict(theta))
    if ripple is not None:
        h = predict_with_ripple(posterior, h, ripple, turn)
    return Score(relative_misfit(posterior.values, h), theil_coefficient(posterior.values, h))


def predict_with_ripple(
    posterior: Posterior, prediction: np.ndarray, ripple: CorrectedRipple, turn: bool = False
) -> np.ndarray:
    """A prediction (S, F) with the corrected flow ripple in place of the nominal one.

    turn   whether the shaft angle of each recording is fitted again
    """
    corrected = np.array(prediction)
    for o, part in zip(posterior.observations, posterior.forward.slices):
        if o.source != "nominal":
            continue
        orders = np.asarray(o.orders, int)
        h = corrected[:, part] * ripple.at(o.label, orders)
        if turn:
            weighted = np.sum(np.conj(h) * posterior.values[:, part], axis=0)
            h = h * np.exp(1j * orders * find_best_turn(weighted, orders)[0])
        corrected[:, part] = h
    return corrected
