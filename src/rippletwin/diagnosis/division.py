"""Readings of all sensors divided into what a flow at the pump makes and what none does.

At each frequency a unitary matrix takes the readings along the line's response to a flow at the
pump, and across it. Errors of the pump, whatever they are, are along it alone.
"""

from __future__ import annotations

import numpy as np

ALONG, ACROSS = slice(1), slice(1, None)  # of the rows of divided readings


class Division:
    """The division by a response (S, F): the first row of divided readings is along it, the others
    are across it."""

    def __init__(self, response: np.ndarray):
        sensors, count = response.shape
        others = np.broadcast_to(np.eye(sensors, sensors - 1), (count, sensors, sensors - 1))
        basis = np.linalg.qr(np.concatenate([response.T[:, :, None], others], axis=-1))[0]
        self._rows = np.conj(np.swapaxes(basis, 1, 2))

    def divide(self, readings: np.ndarray) -> np.ndarray:
        """Readings (..., S, F) of the sensors, divided: the same shape and unit."""
        return np.einsum("fts,...sf->...tf", self._rows, readings)

    def at_sensors(self, divided: np.ndarray) -> np.ndarray:
        """Divided readings (..., S, F) as the sensors have them, in the same unit."""
        return np.einsum("fts,...tf->...sf", self._rows.conj(), divided)

    def divide_variance(self, variance: np.ndarray) -> np.ndarray:
        """Variance (S, F) of divided readings where the sensors' errors of `variance` (S, F) are
        independent."""
        return np.einsum("fts,sf->tf", np.abs(self._rows) ** 2, variance)

    def variance_at_sensors(self, variance: np.ndarray) -> np.ndarray:
        """Variance (S, F) of the sensors' readings where errors of the rows, of `variance` (S, F),
        are independent."""
        return np.einsum("fts,tf->sf", np.abs(self._rows) ** 2, variance)
