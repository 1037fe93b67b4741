"""Anderson acceleration for a sequence of similar fixed-point problems x = f(x).

The next x is the present value f(x) less the combination of earlier changes of the value whose
changes of the residual f(x) - x come closest to the present residual (Anderson 1965, J. ACM
12:547). Each stored change removes one direction in which plain substitution diverges. The changes
are kept from one problem to the next (Degroote, Bathe & Vierendeels 2009, Comput. Struct. 87:793,
keep them from one time step to the next): where f has changed little, a few passes are enough.
"""

from __future__ import annotations

import numpy as np

MAX_HISTORY = 30  # changes stored; beyond that the oldest is overwritten


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
            self._residuals, self._values = np.empty((2, MAX_HISTORY, flat.size))
        if self._last is not None:
            self._store(residual - self._last[0], flat - self._last[1])
        self._last = residual, flat
        kept = min(self._stored, MAX_HISTORY)
        projection = self._residuals[:kept] @ residual
        weights = np.linalg.lstsq(self._products[:kept, :kept], projection, rcond=1e-12)[0]
        return (flat - weights @ self._values[:kept]).view(complex).reshape(value.shape)

    def _store(self, residual: np.ndarray, value: np.ndarray) -> None:
        """Store a change of both, scaled to a unit change of the residual: unscaled, small changes
        would be lost beside large ones in the least squares."""
        size = np.linalg.norm(residual)
        if not size > 0.0:
            return
        k = self._stored % MAX_HISTORY
        self._stored += 1
        kept = min(self._stored, MAX_HISTORY)
        self._residuals[k], self._values[k] = residual / size, value / size
        row = self._residuals[:kept] @ self._residuals[k]
        self._products[k, :kept] = self._products[:kept, k] = row
