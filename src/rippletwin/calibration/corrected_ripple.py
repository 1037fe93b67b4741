"""The pump's flow ripple as the recordings correct it.

The nominal flow ripple of a data sheet's pump is wrong by several per cent at best, and by half
where relief grooves or free air are not stated. The error model of a fit (`posterior`) has an error
of the source at every frequency. Its most likely value, given what the sensors read, corrects the
ripple of each recording.

At another operating point the same pump errs alike at the same shaft order, because its ports open
at the same angles. There the correction is the mean of those of the fitted recordings.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rippletwin.calibration.fit import Fit
from rippletwin.calibration.posterior import Posterior
from rippletwin.calibration.shaft_angles import best_turn


@dataclass(frozen=True)
class CorrectedRipple:
    """Harmonics of the corrected flow ripple over those of the nominal one, by recording.

    orders   (F,) shaft orders of each recording, ascending
    ratios   (F,) complex, at these orders
    turns    shaft angle, rad, by which the ratio of a recording agrees best with that of the first:
             what all orders have in common as a turn of the shaft is no error of the ripple
    """

    orders: dict[str, np.ndarray]
    ratios: dict[str, np.ndarray]
    turns: dict[str, float]

    def at(self, label: str, orders: np.ndarray) -> np.ndarray:
        """Ratio (N,) at shaft orders (N,) of a recording.

        A recording that was not fitted gets the mean of those that were, turned to the shaft angle
        of the first. Beyond the orders that were fitted the ratio is that of the nearest one.
        """
        if label in self.ratios:
            return self._interpolate(label, orders)
        if not self.ratios:
            return np.ones(len(orders), complex)
        turned = [
            self._interpolate(each, orders) * np.exp(1j * orders * turn)
            for each, turn in self.turns.items()
        ]
        return np.mean(turned, axis=0)

    def _interpolate(self, label: str, orders: np.ndarray) -> np.ndarray:
        known, ratio = self.orders[label], self.ratios[label]
        return np.interp(orders, known, ratio.real) + 1j * np.interp(orders, known, ratio.imag)


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
            turns[o.label] = best_turn(weighted, common)[0]
    return CorrectedRipple(orders, ratios, turns)
