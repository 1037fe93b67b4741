"""Fixed points of functions of which one's solution leads to the next's.

Substitution mixed as Anderson does (1965, J. ACM 12:547): where x goes next is the value there less
what, of the changes of value seen so far, would make the residual least. Each change takes one
direction out in which substitution diverges. What has been seen is kept from one solution to the
next, as Degroote, Bathe & Vierendeels (2009, Comput. Struct. 87:793) do from one time step to the
next: where the function has changed little, a few passes are left.
"""

from __future__ import annotations

import numpy as np

MAX_HISTORY = 30  # changes kept


class AndersonMixing:
    """Steps towards x, complex and of any one shape, with f(x) = x.

    Real and imaginary parts are mixed as unknowns of their own, for f need not be analytic.
    """

    def __init__(self):
        self._residuals = self._values = None
        self._products = np.empty((MAX_HISTORY, MAX_HISTORY))
        self._seen, self._last = 0, None

    def begin(self) -> None:
        """The function is another from here on, about as steep."""
        self._last = None

    def step(self, x: np.ndarray, value: np.ndarray) -> np.ndarray:
        """Where to go from x, where the function has `value`."""
        flat = np.ascontiguousarray(value).view(float).ravel()
        residual = flat - np.ascontiguousarray(x).view(float).ravel()
        if self._residuals is None:
            self._residuals, self._values = np.empty((2, MAX_HISTORY, flat.size))
        if self._last is not None:
            self._see(residual - self._last[0], flat - self._last[1])
        self._last = residual, flat
        kept = min(self._seen, MAX_HISTORY)
        towards = self._residuals[:kept] @ residual
        share = np.linalg.lstsq(self._products[:kept, :kept], towards, rcond=1e-12)[0]
        return (flat - share @ self._values[:kept]).view(complex).reshape(value.shape)

    def _see(self, residual: np.ndarray, value: np.ndarray) -> None:
        """Keep a change of both, of unit length lest a small one be lost beside the large."""
        size = np.linalg.norm(residual)
        if not size > 0.0:
            return
        k = self._seen % MAX_HISTORY
        self._seen += 1
        kept = min(self._seen, MAX_HISTORY)
        self._residuals[k], self._values[k] = residual / size, value / size
        row = self._residuals[:kept] @ self._residuals[k]
        self._products[k, :kept] = self._products[:kept, k] = row
