"""What an explanation leaves: how much, at which element, and by which law.

The element is the one whose free, smooth correction adds most log evidence to the explanation
(`smooth_corrections`). The law is that of the most likely correction, in words.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rippletwin.calibration.fit import Fit
from rippletwin.calibration.misfit import score_fit
from rippletwin.calibration.ripple_correction import correct_ripple
from rippletwin.explanation.localise.elements import NONE, elements_of, unit_immittance
from rippletwin.explanation.localise.missing_immittance import describe_law
from rippletwin.explanation.localise.residual_bands import (
    residual_conditions,
    residual_frequency_bands,
)
from rippletwin.explanation.localise.smooth_corrections import SmoothCorrections
from rippletwin.explanation.thresholds import (
    EQUIVALENT_LOG_BAYES_FACTOR,
    GOOD_MODEL_ERROR,
    MIN_LOG_BAYES_FACTOR,
    leaves_nothing,
)


@dataclass(frozen=True)
class Remainder:
    """What remains beside a fit.

    misfit            relative, in sample, with the pump's ripple as the fit corrects it
    model_error       relative, what neither noise nor an error of the pump's ripple accounts for
    element           ("source", None), ("sensor", index), ("segment series" or "segment shunt",
                      index), ("shunt" or "series", position in m), or None where no element
                      accounts for it
    interval          (m, m) of the positions that do nearly as well; None without a position
    log_bayes_factor  of the element's correction
    law               of the correction against frequency, in words; None where it has none
    bands_hz, conditions   where the residual is, as in `residual_bands`
    """

    misfit: float
    model_error: float
    element: tuple | None
    interval: tuple[float, float] | None
    log_bayes_factor: float
    law: str | None
    bands_hz: list
    conditions: list


def find_remainder(fit: Fit, observations: Sequence) -> Remainder | None:
    """The remainder of a fit; None where the fit is as good as the data allow."""
    if leaves_nothing(fit):
        return None
    corrections = SmoothCorrections(fit, observations)
    elements = elements_of(fit.twin.rig, observations)
    table = corrections.by_element([*elements, *corrections.promising_positions()])
    plain = table.pop((NONE, None))
    best = max(table, key=table.get)
    gain = table[best] - plain
    if gain < MIN_LOG_BAYES_FACTOR and fit.model_error <= GOOD_MODEL_ERROR:
        return None
    found = gain >= MIN_LOG_BAYES_FACTOR
    return Remainder(
        misfit=score_fit(fit, observations, ripple=correct_ripple(fit, observations)).misfit,
        model_error=float(fit.model_error),
        element=best if found else None,
        interval=_interval(corrections, best) if found else None,
        log_bayes_factor=float(gain),
        law=_law(corrections, best) if found else None,
        bands_hz=residual_frequency_bands(fit, observations),
        conditions=residual_conditions(fit, observations),
    )


def _interval(corrections: SmoothCorrections, best: tuple) -> tuple[float, float] | None:
    """Ends (m) of the positions whose correction of the same kind promises nearly as much."""
    kind, position = best
    if kind not in corrections.promises:
        return None
    positions, promises = corrections.promises[kind]
    length = corrections.network.length
    half = 0.5 * length / len(positions)  # of their distance; a short line has one position only
    close = positions[promises > np.max(promises) - EQUIVALENT_LOG_BAYES_FACTOR]
    low, high = min(close[0] - half, position), max(close[-1] + half, position)
    return float(max(low, 0.0)), float(min(high, length))


def _law(corrections: SmoothCorrections, element: tuple) -> str | None:
    """The law of the most likely correction of an element of the line, in words."""
    if element[0] in ("source", "sensor"):
        return None
    frequency_hz, correction, weight = corrections.most_likely(element)
    unit = unit_immittance(corrections.network, element)
    return describe_law(frequency_hz, correction * unit, weight / np.abs(unit) ** 2)
