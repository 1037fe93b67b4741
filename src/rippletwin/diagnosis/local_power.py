"""Power of readings about each shaft order, and how much of it a prediction explains."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import uniform_filter1d

NEIGHBOURS = 9  # shaft orders over which a power is averaged


def local_power(readings: np.ndarray) -> np.ndarray:
    """Mean square (F,), Pa2, of readings (S, F), Pa, over sensors and neighbouring orders: a zero
    of one sensor, or of one order, is no place where an error is small."""
    power = np.mean(np.abs(readings) ** 2, axis=0)
    return uniform_filter1d(power, min(NEIGHBOURS, len(power)), mode="nearest")


def explained_power(measured: np.ndarray, predicted: np.ndarray) -> np.ndarray:
    """Local power (F,), Pa2, of a measured change (S, F), Pa, times the share of it that the
    predicted one explains at the best size: their coherence."""
    powers = [np.sum(np.abs(x) ** 2) for x in (measured, predicted)]
    if not all(powers):
        return np.zeros(measured.shape[1])
    share = np.abs(np.vdot(predicted, measured)) ** 2 / np.prod(powers)
    return share * local_power(measured)
