"""The corrected flow ripple of a pump over its nominal one, by shaft order.

At another operating point the same pump errs alike at the same shaft order, because its ports open
at the same angles. There the correction is the mean of those of the fitted recordings.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


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
        """Complex ratio (N,) at shaft orders (N,) of a recording.

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

    def as_dict(self) -> dict:
        """Plain data, by recording."""
        return {
            label: {
                "orders": [int(k) for k in self.orders[label]],
                "re": ratio.real.tolist(),
                "im": ratio.imag.tolist(),
                "turn_rad": float(self.turns[label]),
            }
            for label, ratio in self.ratios.items()
        }

    @classmethod
    def from_dict(cls, data: dict) -> CorrectedRipple:
        """What `as_dict` made."""
        return cls(
            {label: np.array(own["orders"], int) for label, own in data.items()},
            {label: np.array(own["re"]) + 1j * np.array(own["im"]) for label, own in data.items()},
            {label: float(own["turn_rad"]) for label, own in data.items()},
        )
