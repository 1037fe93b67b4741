"""Covariance of what a line answers at speeds that differ and change, and its low-rank factor."""

from __future__ import annotations

import numpy as np
from numba import njit

RESIDUAL_VARIANCE = 1e-13  # of a response of unit variance, that a factor may leave


@njit(cache=True, error_model="numpy")
def response_covariance(deviation, chirp, other_deviation, other_chirp, width):
    """Covariance (N,) of the responses at N speeds with that at another.

    deviation, chirp   (N,) relative deviations of the speeds, and their rates of change over twice
                       the angular frequency; other_deviation and other_chirp likewise
    width              relative speed over which a response changes
    """
    out = np.empty(len(deviation), np.complex128)
    for i in range(len(deviation)):
        square = width**2 - 2j * (chirp[i] - other_chirp)
        away = deviation[i] - other_deviation
        out[i] = width / np.sqrt(square) * np.exp(-0.5 * away**2 / square)
    return out


@njit(cache=True, error_model="numpy")
def factor_covariance(deviation, chirp, width):
    """L (N, r) with L L^H the covariance of the responses at N speeds, r <= N.

    Cholesky's decomposition with pivots, which ends when no variance is left (Harbrecht, Peters &
    Schneider 2012, Appl. Numer. Math. 62:428). It costs N r^2, and r is small where all speeds lie
    within a few widths.
    """
    count = len(deviation)
    rows = np.empty((count, count), np.complex128)
    variance = np.ones(count)
    for m in range(count):
        pivot = np.argmax(variance)
        if variance[pivot] <= RESIDUAL_VARIANCE:
            return np.ascontiguousarray(rows[:m].T)
        row = response_covariance(deviation, chirp, deviation[pivot], chirp[pivot], width)
        for k in range(m):
            share = np.conj(rows[k, pivot])
            for i in range(count):
                row[i] -= share * rows[k, i]
        root = 1.0 / np.sqrt(variance[pivot])
        for i in range(count):
            rows[m, i] = row[i] * root
            variance[i] -= rows[m, i].real ** 2 + rows[m, i].imag ** 2
        variance[pivot] = 0.0
    return np.ascontiguousarray(rows.T)
