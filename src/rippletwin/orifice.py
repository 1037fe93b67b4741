"""The square-law orifice at full amplitude, for many recordings' harmonics side by side.

At the load the line says a p + b q = c for each harmonic and the orifice q(t) = K sqrt(P + p(t)),
P being the mean pressure drop. With Y the load's linear admittance and n(p) what the orifice's
harmonics have beyond its linear part,

    q = Y p + n(p),   a p + b (Y p + n(p)) = c,

which couples the harmonics of one recording. Repeated substitution: |n|/|Y p| is about |p|/(4 P),
a per cent or so, hence each pass gains about two digits.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numba import njit

MAX_PASSES, TOLERANCE = 50, 1e-10
LOWEST_DROP = 1e-3  # of the mean pressure drop: the law is held there, to stay real


class Orifice:
    """Which columns are harmonics of which recording.

    slices  one a recording, of the F columns
    orders  (F,) shaft orders
    drop, coefficient   one a recording: P in Pa and K in m3/s/sqrt(Pa)
    """

    def __init__(
        self, slices: Sequence[slice], orders: np.ndarray, drop: np.ndarray, coefficient: np.ndarray
    ):
        self._edges = np.array([[part.start, part.stop] for part in slices])
        self._harmonic = np.zeros(len(orders), dtype=np.int64)
        for part in slices:
            own = np.asarray(orders[part]).astype(np.int64)
            self._harmonic[part] = own // np.gcd.reduce(own)
        samples = 1 << int(np.ceil(np.log2(4 * self._harmonic.max() + 4)))
        phase = 2 * np.pi * np.arange(samples) / samples
        self._cos, self._sin = np.cos(phase), np.sin(phase)
        self._drop, self._coefficient = drop, coefficient

    def solve(
        self, a, b, c, admittance, factor: float, tolerance: float = TOLERANCE
    ) -> tuple[np.ndarray, np.ndarray]:
        """Pressure and flow (F,) at the load for line relation a, b, c (F,) and `admittance` (F,).

        `factor` multiplies the coefficients. Columns of no recording get the linear answer.
        `tolerance` is of the largest pressure.
        """
        total = a + b * admittance
        coefficient = factor * self._coefficient
        p, n = _substitute(
            b / total, c / total, self._edges, self._harmonic, self._cos, self._sin, self._drop,
            coefficient, tolerance,
        )  # fmt: skip
        return p, admittance * p + n


@njit(cache=True)
def _substitute(b, c, edges, harmonic, cos, sin, drop, coefficient, tolerance):
    """p = c - b n(p) by repeated substitution, and n, both (F,)."""
    p, n = c.copy(), np.zeros_like(c)
    samples = len(cos)
    wave = np.empty(samples)
    for r in range(len(edges)):
        start, stop = edges[r]
        slope = coefficient[r] / (2.0 * np.sqrt(drop[r]))
        for _ in range(MAX_PASSES):
            wave[:] = 0.0
            for k in range(start, stop):
                m, x, y = harmonic[k], p[k].real, p[k].imag
                for i in range(samples):
                    j = (m * i) & (samples - 1)
                    wave[i] += x * cos[j] - y * sin[j]
            for i in range(samples):
                held = max(drop[r] + wave[i], LOWEST_DROP * drop[r])
                wave[i] = coefficient[r] * np.sqrt(held) - slope * wave[i]
            change = largest = 0.0
            for k in range(start, stop):
                m, re, im = harmonic[k], 0.0, 0.0
                for i in range(samples):
                    j = (m * i) & (samples - 1)
                    re += wave[i] * cos[j]
                    im -= wave[i] * sin[j]
                n[k] = 2.0 / samples * (re + 1j * im)
                new = c[k] - b[k] * n[k]
                change = max(change, abs(new - p[k]))
                largest = max(largest, abs(new))
                p[k] = new
            if change <= tolerance * largest:
                break
    return p, n
