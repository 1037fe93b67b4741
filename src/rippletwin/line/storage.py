"""What a line stores beyond proportion to the pressure, at full amplitude and for many recordings.

Where the compressibility depends on the pressure itself, a length dx stores g(p) dx beyond its
linear part, the harmonics of one recording couple all along the line, and s g(p) dx leaves it as
a flow of its own (`rippletwin.line.drains`). Substitution, together with the load's law, mixed as
Anderson (1965, J. ACM 12:547) does: g is a tenth or less of what the line stores in proportion, but
at a sharp resonance the flows of one pass move the pressure as much as the source does, and at
several of them by more: what is mixed must know as many directions as there are of these.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numba import njit
from scipy.fft import irfft, next_fast_len, rfft

from rippletwin.line.drains import Basis

A_WAVE = 2  # places on the shortest wave: what it takes up itself hardly matters
PASSES, TOLERANCE = 80, 0.005  # of the largest flow: what a pass still changes
MIXED = 30  # passes before, at most: each takes one direction out in which substitution diverges
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


class FullAmplitude:
    """Which columns are harmonics of which recording; `slices`, `orders` as in `Orifice`."""

    def __init__(self, slices: Sequence[slice], orders: np.ndarray):
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
        basis = Basis(network, x)
        laws = []
        for part, _, _ in self.recordings:
            own = [(s.pressure[part][0], *s.series[:, part][:, 0]) for s in network.storage]
            laws.append(np.array(own)[of])

        def stored(leaving):
            pressure = basis.respond(law(*basis.relation(leaving)), leaving)
            flow = np.zeros_like(leaving)
            for own, (part, harmonic, samples) in zip(laws, self.recordings):
                share = _share(own, pressure[:, part], harmonic, samples)
                flow[:, part] = network.s[part] * volume[:, None] * share
            return flow

        leaving = _fixed_point(stored, np.zeros((len(x), len(network.s)), complex))
        network.drains = x, leaving
        return law(*basis.relation(leaving))


def _fixed_point(function: Callable, x: np.ndarray) -> np.ndarray:
    """x (complex) with function(x) = x, to TOLERANCE or as near as PASSES come."""
    tried, given = [], []
    for _ in range(PASSES):
        value = function(x)
        tried = [*tried[1 - MIXED :], x]
        given = [*given[1 - MIXED :], value]
        if not np.abs(value - x).max() > TOLERANCE * np.abs(value).max():
            break
        left = np.array([(b - a).view(float).ravel() for a, b in zip(tried, given)])
        change = left[-1] - left[:-1]
        share = np.linalg.lstsq(change @ change.T, change @ left[-1], rcond=1e-12)[0]
        x = value - sum(c * (value - before) for c, before in zip(share, given))
    return value


def _share(law, pressure, harmonic, samples):
    """Harmonics (cells, H) of the share stored, for those of the pressure; `law` (cells, 1 + K)
    holds P and the c_k."""
    spectrum = np.zeros((len(pressure), samples // 2 + 1), complex)
    spectrum[:, harmonic] = 0.5 * samples * pressure
    wave = irfft(spectrum, samples)
    _follow(law, wave)
    return rfft(wave)[:, harmonic] * (2.0 / samples)


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
    for n, storage in enumerate(network.storage):
        k = storage.segment
        turn = np.abs(np.sqrt(network.series[k] * network.shunt[k]).imag).max()
        cells = int(np.ceil(network.lengths[k] * turn * A_WAVE / (2 * np.pi)))
        length = network.lengths[k] / cells
        x.append(ends[k] - network.lengths[k] + length * (np.arange(cells) + 0.5))
        volume.append(np.full(cells, length * storage.area))
        of.append(np.full(cells, n))
    return np.concatenate(x), np.concatenate(volume), np.concatenate(of)
