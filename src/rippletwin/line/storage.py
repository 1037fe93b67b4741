"""What a line stores beyond proportion to the pressure, at full amplitude and for many recordings.

Where the compressibility depends on the pressure itself, a length dx stores g(p) dx beyond its
linear part, the harmonics of one recording couple all along the line, and s g(p) dx leaves it as
a flow of its own (`rippletwin.line.drains`). Repeated substitution, together with the load's law:
g is a tenth or less of what the line stores in proportion, and each pass gains a digit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from rippletwin.line.drains import Basis

A_WAVE = 2  # places on the shortest wave: what it takes up itself hardly matters
PASSES, TOLERANCE = 20, 0.02  # the next pass would change a tenth of that
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
            self.recordings.append((part, harmonic, next_fast_len(4 * int(harmonic.max()) + 4)))

    def drain(self, network, law: Callable) -> tuple[np.ndarray, np.ndarray]:
        """Give `network` the drains that its `storage` amounts to; returns the load's (p, q).

        `law` (a, b, c) -> (p, q) at the load.
        """
        x, volume, of = _cells(network)
        basis = Basis(network, x)
        leaving = np.zeros((len(x), len(network.s)), complex)
        laws = []
        for part, _, _ in self.recordings:
            own = [(s.pressure[part][0], *s.series[:, part][:, 0]) for s in network.storage]
            laws.append(np.array(own)[of].T[..., None])
        for _ in range(PASSES):
            pressure = basis.respond(law(*basis.relation(leaving)), leaving)[0]
            before, leaving = leaving, np.zeros_like(leaving)
            for own, (part, harmonic, samples) in zip(laws, self.recordings):
                share = _share(own, pressure[:, part], harmonic, samples)
                leaving[:, part] = network.s[part] * volume[:, None] * share
            if not np.abs(leaving - before).max() > TOLERANCE * np.abs(leaving).max():
                break
        network.drains = x, leaving
        return law(*basis.relation(leaving))


def _share(law, pressure, harmonic, samples):
    """Harmonics (cells, H) of the share stored, for those of the pressure; `law` (1 + K, cells, 1)
    holds P and the c_k."""
    spectrum = np.zeros((len(pressure), samples // 2 + 1), complex)
    spectrum[:, harmonic] = 0.5 * samples * pressure
    x = np.clip(irfft(spectrum, samples) / law[0], -FURTHEST, FURTHEST)
    share = law[-1] * x
    for c in law[-2:0:-1]:
        share = (share + c) * x
    return rfft(share * x)[:, harmonic] * (2.0 / samples)


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
