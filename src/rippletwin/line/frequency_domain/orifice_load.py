"""The square-law orifice at full amplitude, for many recordings' harmonics side by side.

At the load the line says a p + b q = c for each harmonic and the orifice

    q(t) = K (1 + y(t)) sqrt(P + p(t)),

P being the mean pressure drop and y what a valve that follows the pressure opens, y = H p/(2 P)
harmonic by harmonic: Merritt (1967, Hydraulic Control Systems, sec. 8-2), whose valve is linear.
K is the data sheet's, or such that the mean flow passes at this ripple. With Y the load's linear
admittance, the valve's with it, and n(p) what the orifice's harmonics have beyond that,

    q = Y p + n(p),   a p + b (Y p + n(p)) = c,

which couples the harmonics of one recording. It is solved by repeated substitution: |n|/|Y p| is
about |p|/(4 P), a per cent or so, so that each pass gains about two digits. Where the drop nearly
vanishes in a period, whole passes overshoot; short ones follow, which settle unless there is no
such state.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
from numba import njit

from rippletwin.line.compilation import uncounted

MAX_PASSES = 50
MAX_SHORT_PASSES, SHORT_PASS = 200, 0.3  # after those, and the share of the way that each goes
PRESSURE_TOLERANCE = 1e-10  # change in a pass over a recording's largest harmonic
MIN_RELATIVE_DROP = 1e-3  # of the mean drop: the law is clipped there, to stay real


class OrificeLoad:
    """The orifice of fixed recordings.

    slices  columns of each recording, of all F
    orders  (F,) shaft orders
    drop, coefficient   of each recording: P in Pa and K in m3/s/sqrt(Pa) without a ripple
    passes_flow         whether K is scaled so that the mean flow with a ripple is K sqrt(P)
    solved              whether the last solution is one; else it is the last iterate
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
        # The even samples of a period; the odd ones lie half-way between.
        self._roots = _roots(1 << int(np.ceil(np.log2(2 * self._harmonic.max() + 2))))
        self._drop, self._coefficient = drop, coefficient
        self._passes_flow, self.solved = passes_flow, True

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
        p, n, self.solved = _substitute(
            b / total, c / total, np.asarray(opening, complex), self._edges, self._harmonic,
            self._roots, self._drop, coefficient, self._passes_flow, tolerance,
        )  # fmt: skip
        return p, admittance * p + n


@cache
def _roots(count: int) -> np.ndarray:
    """cos and sin of the phases i/count, and of half of them, i = 0 to count - 1: (4, count)."""
    phase = 2 * np.pi * np.arange(count) / count
    return np.array([np.cos(phase), np.sin(phase), np.cos(phase / 2), np.sin(phase / 2)])


@njit(cache=True, error_model="numpy")
def _substitute(b, c, opening, edges, harmonic, roots, drop, coefficient, passes_flow, tolerance):
    """p = c - b n(p) by repeated substitution, and n, both (F,); whether it converged.

    Of a signal over a period the even samples are one array and the odd ones another: two real
    signals, which one complex transform of half the length takes together.
    """
    p, n, solved = c.copy(), np.zeros_like(c), True
    samples = 2 * roots.shape[1]
    even, odd, more_even, more_odd, opened_even, opened_odd = np.zeros((6, roots.shape[1]))
    for r in range(len(edges)):
        here = slice(edges[r, 0], edges[r, 1])
        root = np.sqrt(drop[r])
        slope = coefficient[r] / (2.0 * root)
        for done in range(MAX_PASSES + MAX_SHORT_PASSES):
            share = 1.0 if done < MAX_PASSES else SHORT_PASS
            _sum_waves(p[here], harmonic[here], even, odd, more_even, more_odd, roots)
            if len(opening) > 0:  # 2 P times what the valve opens
                _sum_waves(
                    opening[here] * p[here], harmonic[here], opened_even, opened_odd,
                    more_even, more_odd, roots,
                )  # fmt: skip
            passed = _pass_flow(drop[r], even, opened_even, more_even)
            passed += _pass_flow(drop[r], odd, opened_odd, more_odd)
            scale = coefficient[r] * (root / (passed / samples) if passes_flow else 1.0)
            _take_linear_part(scale, slope, more_even, opened_even, even)
            _take_linear_part(scale, slope, more_odd, opened_odd, odd)
            _find_harmonics(even, odd, harmonic[here], n[here], more_even, more_odd, roots)
            change = largest = 0.0
            for k in range(here.start, here.stop):
                new = c[k] - b[k] * n[k]
                change = max(change, abs(new - p[k]))
                largest = max(largest, abs(new))
                p[k] = (1.0 - share) * p[k] + share * new
            if change <= tolerance * largest:
                break
        else:
            solved = False
    return p, n, solved and np.all(np.isfinite(p))


@uncounted
def _sum_waves(amplitude, harmonic, even, odd, more_even, more_odd, roots):
    """Even and odd samples (N,) of the sum of waves of peak `amplitude` (H,) at `harmonic` (H,)."""
    even[:] = 0.0
    odd[:] = 0.0
    for k in range(len(harmonic)):
        m, a = harmonic[k], 0.5 * amplitude[k]
        later = a * complex(roots[2, m], roots[3, m])  # half-way between two even samples
        below, above = a.conjugate() + 1j * later.conjugate(), a + 1j * later
        even[m] += below.real
        odd[m] += below.imag
        even[len(even) - m] += above.real
        odd[len(even) - m] += above.imag
    _transform(even, odd, more_even, more_odd, roots[0], roots[1])


@uncounted
def _find_harmonics(even, odd, harmonic, amplitude, more_even, more_odd, roots):
    """The peak `amplitude` (H,) at `harmonic` (H,) of a signal, whose samples are overwritten."""
    count = len(even)
    _transform(even, odd, more_even, more_odd, roots[0], roots[1])
    for k in range(len(harmonic)):
        m = harmonic[k]
        here, mirror = complex(even[m], odd[m]), complex(even[count - m], -odd[count - m])
        of_odd = -1j * (here - mirror) * complex(roots[2, m], -roots[3, m])
        amplitude[k] = 0.5 / count * (here + mirror + of_odd)


@uncounted
def _pass_flow(drop, pressure, opened, flow):
    """The flow (N,) through the orifice over its coefficient; its sum over the samples."""
    for i in range(len(flow)):
        root_drop = np.sqrt(max(drop + pressure[i], MIN_RELATIVE_DROP * drop))
        flow[i] = (1.0 + 0.5 / drop * opened[i]) * root_drop
    passed = 0.0
    for i in range(len(flow)):
        passed += flow[i]
    return passed


@uncounted
def _take_linear_part(scale, slope, flow, opened, pressure):
    """What the orifice passes beyond its linear law, in place of the `pressure` (N,)."""
    for i in range(len(flow)):
        pressure[i] = scale * flow[i] - slope * (pressure[i] + opened[i])


@uncounted
def _transform(re, im, more_re, more_im, cos, sin):
    """Discrete Fourier transform sum_i x_i exp(-j k phi_i) of re + j im, in place.

    cos, sin   (N,) of phi_i = 2 pi i/N, N a power of two and at least 4
    more_re, more_im   (N,) room for the work

    The self-sorting form for a length that is a power of two (Stockham; Van Loan 1992,
    Computational Frameworks for the Fast Fourier Transform, sec. 1.7) with stages of base four, and
    a last one of base two where N is no power of four.
    """
    count, stride, swapped = len(re), 1, False
    while 4 * stride <= count:
        _fold_by_four(re, im, more_re, more_im, cos, sin, stride)
        re, im, more_re, more_im = more_re, more_im, re, im
        stride, swapped = 4 * stride, not swapped
    if stride < count:
        half = count // 2
        high_re, high_im = re[half:], im[half:]
        for k in range(half):
            x, y = high_re[k], high_im[k]
            high_re[k], high_im[k] = re[k] - x, im[k] - y
            re[k], im[k] = re[k] + x, im[k] + y
    if swapped:  # the result is in the room
        for k in range(count):
            more_re[k], more_im[k] = re[k], im[k]


@uncounted
def _fold_by_four(re, im, out_re, out_im, cos, sin, stride):
    """One stage: four-point transforms across the quarters, times exp(-j m phi), interleaved.

    Arrays are taken as views from their first element on: the compiler then knows that no index
    wraps, and vectorises.
    """
    quarter = len(re) // 4
    re_1, im_1 = re[quarter:], im[quarter:]
    re_2, im_2 = re[2 * quarter :], im[2 * quarter :]
    re_3, im_3 = re[3 * quarter :], im[3 * quarter :]
    out_re_1, out_im_1 = out_re[stride:], out_im[stride:]
    out_re_2, out_im_2 = out_re[2 * stride :], out_im[2 * stride :]
    out_re_3, out_im_3 = out_re[3 * stride :], out_im[3 * stride :]
    for first in range(0, quarter, stride):
        c1, s1 = cos[first], -sin[first]
        c2, s2 = c1 * c1 - s1 * s1, 2.0 * c1 * s1
        c3, s3 = c1 * c2 - s1 * s2, c1 * s2 + s1 * c2
        for k in range(stride):
            j, out = first + k, 4 * first + k
            sum_re, sum_im = re[j] + re_2[j], im[j] + im_2[j]
            rest_re, rest_im = re[j] - re_2[j], im[j] - im_2[j]
            other_re, other_im = re_1[j] + re_3[j], im_1[j] + im_3[j]
            turned_re, turned_im = im_1[j] - im_3[j], re_3[j] - re_1[j]  # -j (x_1 - x_3)
            out_re[out], out_im[out] = sum_re + other_re, sum_im + other_im
            x, y = rest_re + turned_re, rest_im + turned_im
            out_re_1[out], out_im_1[out] = c1 * x - s1 * y, c1 * y + s1 * x
            x, y = sum_re - other_re, sum_im - other_im
            out_re_2[out], out_im_2[out] = c2 * x - s2 * y, c2 * y + s2 * x
            x, y = rest_re - turned_re, rest_im - turned_im
            out_re_3[out], out_im_3[out] = c3 * x - s3 * y, c3 * y + s3 * x
