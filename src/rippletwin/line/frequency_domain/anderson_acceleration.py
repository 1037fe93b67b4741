"""Anderson acceleration for a sequence of similar fixed-point problems x = f(x).

The next x is the present value f(x) less the combination of earlier changes of the value whose
changes of the residual f(x) - x come closest to the present residual (Anderson 1965, J. ACM
12:547). Each stored change removes one direction in which plain substitution diverges. The changes
are kept from one problem to the next (Degroote, Bathe & Vierendeels 2009, Comput. Struct. 87:793,
keep them from one time step to the next): where f has changed little, a few passes are enough.

A step takes as long as the stored changes take to be read. They are single precision, and read
once each. Sums are of double precision.
"""

from __future__ import annotations

import numpy as np

from rippletwin.line.compilation import summing

MAX_HISTORY = 30  # changes stored; beyond that the oldest is overwritten
RIDGE = 1e-12  # added to the squares of unit changes: below it, directions are rounding
CHUNK = 2048  # numbers at a time, so that they stay in the first-level cache


class AndersonAcceleration:
    """Iterates towards x = f(x) for complex x of any one shape.

    Real and imaginary parts are separate unknowns, since f need not be analytic.
    """

    def __init__(self):
        self._residuals = self._values = None  # changes (MAX_HISTORY, unknowns), of unit residual
        self._products = np.empty((MAX_HISTORY, MAX_HISTORY))  # of the stored residuals
        self._stored, self._last = 0, None

    def start(self) -> None:
        """Begin the next problem: f is another function from here on, with a similar slope."""
        self._last = None

    def step(self, x: np.ndarray, value: np.ndarray) -> np.ndarray:
        """The next x, complex and of the same shape as x and `value`, after `value` = f(x)."""
        flat = np.ascontiguousarray(value).view(float).ravel()
        residual = flat - np.ascontiguousarray(x).view(float).ravel()
        if self._residuals is None:
            self._residuals, self._values = np.empty((2, MAX_HISTORY, flat.size), np.float32)
        newest = None
        if self._last is not None:
            newest = self._store(residual - self._last[0], flat - self._last[1])
        self._last = residual, flat
        kept = min(self._stored, MAX_HISTORY)
        latest = residual if newest is None else self._residuals[newest].astype(float)
        row, projection = np.zeros((2, kept))
        _add_products(self._residuals[:kept], latest, residual, row, projection)
        if newest is not None:
            self._products[newest, :kept] = self._products[:kept, newest] = row
        squares = self._products[:kept, :kept] + RIDGE * np.eye(kept)
        weights = np.linalg.solve(squares, projection)
        result = flat.copy()
        _subtract_combination(self._values[:kept], weights, result)
        return result.view(complex).reshape(value.shape)

    def _store(self, residual: np.ndarray, value: np.ndarray) -> int | None:
        """Store a change of both, scaled to a unit change of the residual: unscaled, small changes
        would be lost beside large ones in the least squares. Returns where; None for no change."""
        size = np.linalg.norm(residual)
        if not size > 0.0:
            return None
        k = self._stored % MAX_HISTORY
        self._stored += 1
        self._residuals[k], self._values[k] = residual / size, value / size
        return k


@summing
def _add_products(history, one, two, by_one, by_two):
    """Add the products of the rows of `history` (K, N) with `one` and `two` (N,) to (K,).

    Loops run over views from their first element on: the compiler then knows that no index wraps,
    and vectorises.
    """
    for start in range(0, len(one), CHUNK):
        x, y = one[start : start + CHUNK], two[start : start + CHUNK]
        for k in range(len(history)):
            row = history[k, start : start + CHUNK]
            first = second = 0.0
            for i in range(len(row)):
                first += row[i] * x[i]
                second += row[i] * y[i]
            by_one[k] += first
            by_two[k] += second


@summing
def _subtract_combination(history, weights, result):
    """Subtract sum_k weights[k] history[k] of the rows of `history` (K, N) from `result` (N,)."""
    for start in range(0, len(result), CHUNK):
        part = result[start : start + CHUNK]
        for k in range(len(history)):
            row, weight = history[k, start : start + CHUNK], weights[k]
            for i in range(len(part)):
                part[i] -= weight * row[i]
