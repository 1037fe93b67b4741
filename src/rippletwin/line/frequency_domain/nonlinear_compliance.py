"""What a line stores beyond proportion to the pressure, at full amplitude and for many recordings.

Where the compressibility depends on the pressure itself, a length dx stores g(p) dx beyond its
linear part, the harmonics of one recording couple all along the line, and s g(p) dx leaves it as
a flow of its own (`prescribed_outflows`). Substitution, together with the load's law, mixed
(`anderson_acceleration`): g is a tenth or less of what the line stores in proportion, but at a
sharp resonance the flows of one pass move the pressure as much as the source does, and at several
of them by more: what is mixed must know as many directions as there are of these. Recordings do
not couple, and each has directions of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numba import njit
from scipy.fft import next_fast_len

from rippletwin.harmonics import one_period, peak_amplitudes
from rippletwin.line.frequency_domain.anderson_acceleration import AndersonMixing
from rippletwin.line.frequency_domain.prescribed_outflows import FundamentalSolutions

A_WAVE = 2  # places on the shortest wave: what it takes up itself hardly matters
PASSES, TOLERANCE = 80, 0.0005  # of a recording's largest flow: what a pass still changes
HOPELESS = 25, 0.5  # passes after which this much must have been reached
SHARES = (0.35, 0.7, 1.0)  # of what is stored, one after the other, where all at once fails
FINE = 3  # samples a wave of the highest harmonic: what is folded of its square stays above half
FURTHEST = 0.9  # of the law's pressure: there it is held


class Storage(NamedTuple):
    """Segment `segment` (from 0) of `area` (m2) stores the share sum_k c_k x^k, k = 2, 3 ..., of
    its volume beyond its linear part where the pressure is x P above the mean.

    pressure (F,) is P in Pa and series (K, F) the c_k of the recording of each frequency.
    """

    segment: int
    area: float
    pressure: np.ndarray
    series: np.ndarray


class NonlinearComplianceSolver:
    """Which columns are harmonics of which recording; `slices`, `orders` as in `Orifice`.

    recordings  (columns, harmonics, samples a period) of each
    tolerance   of what leaves, relative to a recording's largest flow
    resumed     whether a solution begins where the last one ended: far fewer passes, and an answer
                that is the same only to `tolerance`
    solved      whether the last one is a steady state; else it is the nearest found to that
    """

    def __init__(self, slices: Sequence[slice], orders: np.ndarray):
        self.tolerance, self.resumed, self.solved = TOLERANCE, False, True
        self._leaving, self._mixed = None, []
        self.recordings = []
        for part in slices:
            own = np.asarray(orders[part]).astype(int)
            harmonic = own // np.gcd.reduce(own)
            self.recordings.append((part, harmonic, next_fast_len(FINE * int(harmonic.max() + 1))))

    def drain(self, network, law: Callable) -> tuple[np.ndarray, np.ndarray]:
        """Give `network` the drains that its `storage` amounts to; returns the load's (p, q).

        `law` (a, b, c) -> (p, q) at the load.
        """
        x, volume, of = _cells(network)
        basis = FundamentalSolutions(network, x)
        laws = []
        for part, _, _ in self.recordings:
            own = [
                (s.pressure[part][0], *s.series[:, part][:, 0])
                for s in network.nonlinear_compliances
            ]
            laws.append(np.array(own)[of])

        def stored(leaving):
            pressure = basis.respond(law(*basis.relation(leaving)), leaving)
            flow = np.zeros_like(leaving)
            for own, (part, harmonic, samples) in zip(laws, self.recordings):
                share = _share(own, pressure[:, part], harmonic, samples)
                flow[:, part] = network.s[part] * volume[:, None] * share
            return flow

        leaving = self._steady(stored, (len(x), len(network.s)))
        network.outflows = x, leaving
        return law(*basis.relation(leaving))

    def _steady(self, stored: Callable, shape: tuple) -> np.ndarray:
        """What leaves (N, F) where `stored` of it is the same, or the nearest found to that."""
        self.solved = False
        if self.resumed and self._leaving is not None and self._leaving.shape == shape:
            value = self._fixed_point(stored, self._leaving)
        for shares in ((1.0,), SHARES):
            if self.solved:
                break
            self._mixed = [AndersonMixing() for _ in self.recordings]
            value = np.zeros(shape, complex)
            for share in shares:
                value = self._fixed_point(stored, value, share)
                if not self.solved:
                    break
        self._leaving = value if self.solved else None
        return value

    def _fixed_point(self, function: Callable, x: np.ndarray, share: float = 1.0) -> np.ndarray:
        """x (N, F), complex, with share function(x) = x, or as near as PASSES come."""
        parts, reached = [part for part, *_ in self.recordings], np.inf
        for mixed in self._mixed:
            mixed.begin()
        for done in range(1, PASSES + 1):
            value = share * function(x)
            off, size = np.abs(value - x).max(axis=0), np.abs(value).max(axis=0)
            error = max(off[part].max() / max(size[part].max(), 1e-300) for part in parts)
            reached = min(reached, error)
            self.solved = bool(error <= self.tolerance)
            hopeless = done > HOPELESS[0] and reached > HOPELESS[1]
            if self.solved or hopeless or not np.isfinite(error):
                break
            x = x.copy()
            for mixed, part in zip(self._mixed, parts):
                x[:, part] = mixed.step(x[:, part], value[:, part])
        return value


def _share(law, pressure, harmonic, samples):
    """Harmonics (cells, H) of the share stored, for those of the pressure; `law` (cells, 1 + K)
    holds P and the c_k."""
    wave = one_period(pressure, samples, harmonic)
    _follow(law, wave)
    return peak_amplitudes(wave)[:, harmonic]


@njit(cache=True)
def _follow(law, wave):
    """Pressures (cells, samples) become the shares stored."""
    for law_here, row in zip(law, wave):
        for i in range(len(row)):
            x = min(max(row[i] / law_here[0], -FURTHEST), FURTHEST)
            share = 0.0
            for k in range(len(law_here) - 1, 0, -1):
                share = (share + law_here[k]) * x
            row[i] = share * x


def _cells(network):
    """Middles (N,) and volumes of cells of the storing segments, and which storage each is of."""
    ends = np.cumsum(network.lengths)
    x, volume, of = [], [], []
    for n, storage in enumerate(network.nonlinear_compliances):
        k = storage.segment
        turn = np.abs(np.sqrt(network.series[k] * network.shunt[k]).imag).max()
        cells = int(np.ceil(network.lengths[k] * turn * A_WAVE / (2 * np.pi)))
        length = network.lengths[k] / cells
        x.append(ends[k] - network.lengths[k] + length * (np.arange(cells) + 0.5))
        volume.append(np.full(cells, length * storage.area))
        of.append(np.full(cells, n))
    return np.concatenate(x), np.concatenate(volume), np.concatenate(of)
