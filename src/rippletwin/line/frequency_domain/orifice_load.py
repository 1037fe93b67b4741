"""The square-law orifice at full amplitude, for many recordings' harmonics side by side.

At the load the line says a p + b q = c for each harmonic and the orifice

    q(t) = K (1 + y(t)) sqrt(P + p(t)),

P being the mean pressure drop and y what a valve that follows the pressure opens, y = H p/(2 P)
harmonic by harmonic: Merritt (1967, Hydraulic Control Systems, sec. 8-2), whose valve is linear.
K is the data sheet's, or such that the mean flow passes at this ripple. With Y the load's linear
admittance, the valve's with it, and n(p) what the orifice's harmonics have beyond that,

    q = Y p + n(p),   a p + b (Y p + n(p)) = c,

which couples the harmonics of one recording. It is solved by repeated substitution: |n|/|Y p| is
about |p|/(4 P), a per cent or so, so that each pass gains about two digits.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numba import njit

MAX_PASSES = 50
PRESSURE_TOLERANCE = 1e-10  # change in a pass over a recording's largest harmonic
MIN_RELATIVE_DROP = 1e-3  # of the mean drop: the law is clipped there, to stay real


class OrificeLoad:
    """The orifice of fixed recordings.

    slices  columns of each recording, of all F
    orders  (F,) shaft orders
    drop, coefficient   of each recording: P in Pa and K in m3/s/sqrt(Pa) without a ripple
    passes_flow         whether K is scaled so that the mean flow with a ripple is K sqrt(P)
    """

    def __init__(
        self,
        slices: Sequence[slice],
        orders: np.ndarray,
        drop: np.ndarray,
        coefficient: np.ndarray,
        passes_flow: bool = False,
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
        self._passes_flow = passes_flow

    def solve(
        self,
        a,
        b,
        c,
        admittance,
        factor: float,
        opening=None,
        tolerance: float = PRESSURE_TOLERANCE,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Pressure and flow (F,) at the load for line relation a, b, c (F,) and `admittance` (F,).

        `factor` multiplies the coefficients. `opening` (F,) is a valve's H; its linear part is
        already in `admittance` or in the line's relation. Columns of no recording get the linear
        solution. `tolerance` is relative to the largest harmonic of the pressure.
        """
        total = a + b * admittance
        coefficient = factor * self._coefficient
        if opening is None:
            opening = np.zeros(0, complex)
        p, n = _substitute(
            b / total, c / total, np.asarray(opening, complex), self._edges, self._harmonic,
            self._cos, self._sin, self._drop, coefficient, self._passes_flow, tolerance,
        )  # fmt: skip
        return p, admittance * p + n


@njit(cache=True)
def _substitute(
    b, c, opening, edges, harmonic, cos, sin, drop, coefficient, passes_flow, tolerance
):
    """p = c - b n(p) by repeated substitution, and n, both (F,)."""
    p, n = c.copy(), np.zeros_like(c)
    samples = len(cos)
    wave, open_by, flow = np.empty(samples), np.zeros(samples), np.empty(samples)
    for r in range(len(edges)):
        start, stop = edges[r]
        root = np.sqrt(drop[r])
        slope = coefficient[r] / (2.0 * root)
        for _ in range(MAX_PASSES):
            wave[:] = 0.0
            open_by[:] = 0.0
            for k in range(start, stop):
                m = harmonic[k]
                _add(wave, p[k], m, cos, sin)
                if len(opening) > 0:
                    _add(open_by, opening[k] * p[k] / (2.0 * drop[r]), m, cos, sin)
            passed = 0.0
            for i in range(samples):
                root_drop = np.sqrt(max(drop[r] + wave[i], MIN_RELATIVE_DROP * drop[r]))
                flow[i] = (1.0 + open_by[i]) * root_drop
                passed += flow[i] / samples
            scale = coefficient[r] * (root / passed if passes_flow else 1.0)
            for i in range(samples):
                linear = slope * wave[i] + coefficient[r] * root * open_by[i]
                flow[i] = scale * flow[i] - linear
            change = largest = 0.0
            for k in range(start, stop):
                m, re, im = harmonic[k], 0.0, 0.0
                for i in range(samples):
                    j = (m * i) & (samples - 1)
                    re += flow[i] * cos[j]
                    im -= flow[i] * sin[j]
                n[k] = 2.0 / samples * (re + 1j * im)
                new = c[k] - b[k] * n[k]
                change = max(change, abs(new - p[k]))
                largest = max(largest, abs(new))
                p[k] = new
            if change <= tolerance * largest:
                break
    return p, n


@njit(cache=True)
def _add(wave, amplitude, harmonic, cos, sin):
    """Add a harmonic of peak complex `amplitude` to a wave."""
    x, y = amplitude.real, amplitude.imag
    samples = len(wave)
    for i in range(samples):
        j = (harmonic * i) & (samples - 1)
        wave[i] += x * cos[j] - y * sin[j]
