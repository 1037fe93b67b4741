"""The pump's flow ripple as recordings correct it.

The nominal flow ripple of a data sheet's pump is wrong by several per cent at best, and by half
where relief grooves or free air are not stated. The error model of a fit (`posterior`) has an error
of the source at every frequency. Its most likely value, given what the sensors read, corrects the
ripple of each recording.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rippletwin.calibration.fit import Fit
from rippletwin.calibration.posterior import Posterior
from rippletwin.calibration.shaft_angles import find_best_turn
from rippletwin.spectra.corrected_ripple import CorrectedRipple
from rippletwin.twin.forward_model import ForwardModel


def correct_ripple(fit: Fit, observations: Sequence) -> CorrectedRipple:
    """The corrected flow ripple of the observations that have a nominal one.

    fit   of these observations with the error model of explaining; with an unknown source nothing
          is corrected
    """
    posterior = Posterior(fit.twin, observations, None, fit.source_free)
    prediction = posterior.predict(fit.twin.theta)
    posterior.estimate_errors(prediction, fit.twin.theta)
    source = posterior.most_likely_source(prediction)
    orders: dict[str, np.ndarray] = {}
    ratios: dict[str, np.ndarray] = {}
    turns: dict[str, float] = {}
    for o, part in zip(posterior.observations, posterior.forward.slices):
        if o.source == "nominal" and not fit.source_free:
            orders[o.label], ratios[o.label] = np.asarray(o.orders, int), source[part]
            first = next(iter(ratios))
            common, a, b = np.intersect1d(orders[first], orders[o.label], return_indices=True)
            weighted = posterior.power[part][b] * np.conj(ratios[o.label][b]) * ratios[first][a]
            # Recordings of bands without a common order do not tell how their angles differ.
            turns[o.label] = find_best_turn(weighted, common)[0] if len(common) else 0.0
    return CorrectedRipple(orders, ratios, turns)


def with_corrected_ripple(fit: Fit, observations: Sequence, data: Sequence) -> list:
    """`data`, the observations that were fitted with another nominal ripple or the same, with the
    corrected ripple that `fit` finds: their nonlinear flow is then that of the ripple that is
    there."""
    corrected, theta = correct_ripple(fit, observations), fit.twin.theta
    before, after = (ForwardModel(fit.twin, each) for each in (observations, data))
    ratio = before.source.at(theta)[0] / after.source.at(theta)[0]
    ratios = {
        o.label: corrected.ratios[o.label] * ratio[part]
        for o, part in zip(observations, before.slices)
        if o.label in corrected.ratios
    }
    corrected = replace(corrected, ratios=ratios)
    return [replace(o, corrected_ripple=corrected) if o.label in ratios else o for o in data]
