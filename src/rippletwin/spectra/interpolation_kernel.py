"""Weighted sums of the samples around fractional positions, compiled."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, error_model="numpy", fastmath={"reassoc", "contract"})  # order of sums is free
def sum_taps(signal, position, table, before):
    """Values (S, P) of `signal` (S, N) at fractional sample numbers `position` (P,).

    table    (E + 1, T) weights of T samples at the fractions 0, 1/E ... 1 of a sample, between
             which they are interpolated linearly
    before   number of samples before the position

    Beyond its ends the signal is constant.
    """
    sensors, samples = signal.shape
    fractions, taps = len(table) - 1, table.shape[1]
    out = np.empty((sensors, len(position)))
    weight, near = np.empty(taps), np.empty(taps)
    for p in range(len(position)):
        base = int(np.floor(position[p]))
        at = (position[p] - base) * fractions
        entry = min(int(at), fractions - 1)
        share = at - entry
        low, high = table[entry], table[entry + 1]
        for t in range(taps):
            weight[t] = low[t] * (1.0 - share) + high[t] * share
        first = base - before
        for s in range(sensors):
            total = 0.0
            if first >= 0 and first + taps <= samples:
                row = signal[s, first : first + taps]
                for t in range(taps):
                    total += weight[t] * row[t]
            else:
                for t in range(taps):
                    near[t] = signal[s, min(max(first + t, 0), samples - 1)]
                for t in range(taps):
                    total += weight[t] * near[t]
            out[s, p] = total
    return out
