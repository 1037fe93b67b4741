"""The arithmetic of `whitening`, compiled: it is done for every prediction and every column."""

from __future__ import annotations

import numpy as np
from numba import njit

TINY = 1e-300
MIN_EIGENVALUE = 1e-12  # of the smooth error's covariance in units of the readings'


@njit(cache=True, error_model="numpy")
def rotate(rotation, x):
    """x (N, S, F) in the bases `rotation` (F, S, S): sum_s rotation[f, s, k] x[n, s, f]."""
    count, sensors, frequencies = x.shape
    out = np.zeros_like(x)
    for n in range(count):
        for s in range(sensors):
            for k in range(sensors):
                for f in range(frequencies):
                    out[n, k, f] += rotation[f, s, k] * x[n, s, f]
    return out


@njit(cache=True, error_model="numpy")
def prepare(h, sd, source, nominal, basis):
    """What a `Whitening` of these arguments needs.

    u               (S, F)
    diagonal        (F,) of M
    left, right     (J, N): the rest of M is right^T left at the frequencies `nominal`
    log determinant of the source's part
    """
    sensors, count = h.shape
    u, diagonal = np.empty_like(h), np.empty(count)
    size, stretch = np.empty(count), np.empty(count)
    volume = 0.0
    for f in range(count):
        total = power = 0.0
        for s in range(sensors):
            u[s, f] = h[s, f] / sd[s, f]
            total += u[s, f].real ** 2 + u[s, f].imag ** 2
            power += h[s, f].real ** 2 + h[s, f].imag ** 2
        size[f], power = max(total, TINY), max(power, TINY)
        if np.isinf(source[f]):
            stretch[f] = 1.0
            diagonal[f] = 1.0 / size[f]
            volume += np.log(size[f] / power)
        else:
            stretch[f] = 1.0 + source[f] ** 2 * size[f]
            diagonal[f] = (1.0 - 1.0 / np.sqrt(stretch[f])) / size[f]
            volume += np.log(stretch[f])
    left, right = np.zeros(basis.shape), np.zeros(basis.shape)
    if np.any(basis != 0.0):
        volume += _prepare_smooth(size, stretch, nominal, basis, left, right)
    return u, diagonal, left, right, volume


@njit(cache=True, error_model="numpy")
def _prepare_smooth(size, stretch, nominal, basis, left, right):
    """Set `left` and `right`, and return the log determinant.

    Whitened by all else, the smooth error is B c with unit c: I + B B^H in the span of B.
    """
    functions, count = basis.shape
    gram = np.zeros((functions, functions))
    columns = np.ascontiguousarray(basis.T)  # the innermost loop goes along memory
    for n in range(count):
        weight = size[nominal[n]] / stretch[nominal[n]]
        for i in range(functions):
            entry = columns[n, i] * weight
            for j in range(i + 1):
                gram[i, j] += entry * columns[n, j]
    grown, turn = np.linalg.eigh(gram)  # of the lower triangle
    volume = 0.0
    for i in range(functions):
        size_i = max(grown[i], MIN_EIGENVALUE)
        reduce = (1.0 - 1.0 / np.sqrt(1.0 + size_i)) / size_i
        volume += np.log1p(size_i)
        for n in range(count):
            along, f = 0.0, nominal[n]
            for j in range(functions):
                along += turn[j, i] * columns[n, j]
            left[i, n] = along / stretch[f] * reduce
            right[i, n] = along / np.sqrt(stretch[f])
    return volume


@njit(cache=True, error_model="numpy")
def remove_along(x, u, diagonal, nominal, left, right):
    """x (N, S, F) less its part u M u^H x, M = diag(diagonal) + right^T left."""
    count, sensors, frequencies = x.shape
    out = np.empty_like(x)
    along, part = np.empty(frequencies, np.complex128), np.empty(frequencies, np.complex128)
    for n in range(count):
        for f in range(frequencies):
            total = 0j
            for s in range(sensors):
                total += np.conj(u[s, f]) * x[n, s, f]
            along[f], part[f] = total, diagonal[f] * total
        for j in range(len(left)):
            share = 0j
            for k in range(len(nominal)):
                share += left[j, k] * along[nominal[k]]
            for k in range(len(nominal)):
                part[nominal[k]] += right[j, k] * share
        for s in range(sensors):
            for f in range(frequencies):
                out[n, s, f] = x[n, s, f] - part[f] * u[s, f]
    return out
