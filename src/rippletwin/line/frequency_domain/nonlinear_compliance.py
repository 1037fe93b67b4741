"""Pressure-dependent (nonlinear) compliance of a line at full amplitude, for many recordings.

Where the compressibility depends on the pressure itself, a piece of the line or a volume of gas on
it stores g(p) beyond its linear part: the harmonics of one recording couple all along the line, and
s g(p) is an outflow (`prescribed_outflows`). Outflows and the state at the load are found by
fixed-point iteration with Anderson acceleration. g is a fraction of the linear storage, but at a
sharp resonance the outflows of one pass change the pressure as much as the source does, and at
several resonances by more: the acceleration must store as many directions as there are such
resonances. Recordings do not couple, and each is accelerated separately.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numba import njit
from scipy.fft import next_fast_len

from rippletwin.harmonics import one_period, peak_amplitudes
from rippletwin.line.frequency_domain.anderson_acceleration import AndersonAcceleration
from rippletwin.line.frequency_domain.prescribed_outflows import FundamentalSolutions

CELLS_PER_WAVELENGTH = 2  # of the highest harmonic, which itself is hardly stored
OUTFLOW_TOLERANCE = 0.0005  # change of the outflows in a pass over a recording's largest outflow
MAX_PASSES = 80
HOPELESS_PASSES, HOPELESS_CHANGE = 25, 0.5  # no better change after so many passes: give up
CONTINUATION_SHARES = (0.35, 0.7, 1.0)  # of the outflows, in turn, where all at once fails
SAMPLES_PER_HIGHEST_HARMONIC = 3  # the aliases of its square then fall above half of it
TINY = 1e-300  # lest the square of nothing be divided by
MAX_RELATIVE_PRESSURE = 0.9  # |x| at which the law is clipped: the series diverges at 1


class NonlinearCompliance(NamedTuple):
    """What stores `volume` sum_k c_k x^k, k = 2, 3 ..., beyond its linear part, where the pressure
    is x P above the mean.

    start, stop  m from the pump: it is evenly spread between them, or lumped where they are equal
    volume       m3; 1 where the c_k are volumes themselves
    pressure     (F,) P in Pa, of the recording of each frequency
    series       (K, F) the c_k, likewise
    """

    start: float
    stop: float
    volume: float
    pressure: np.ndarray
    series: np.ndarray


class NonlinearComplianceSolver:
    """Solver for fixed recordings; `slices` and `orders` as of `OrificeLoad`.

    recordings  (columns, harmonics, samples a period) of each
    tolerance   relative change of the outflows at which an iteration ends
    warm_start  whether a solution starts from the last one: far fewer passes, and a result that is
                reproducible only to `tolerance`
    solved      whether the last solution is a steady state; else it is the last iterate
    """

    def __init__(self, slices: Sequence[slice], orders: np.ndarray):
        self.tolerance, self.warm_start, self.solved = OUTFLOW_TOLERANCE, False, True
        self._outflow: np.ndarray | None = None
        self._accelerations: list[AndersonAcceleration] = []
        self.recordings = []
        for part in slices:
            own = np.asarray(orders[part]).astype(int)
            harmonic = own // np.gcd.reduce(own)
            samples = next_fast_len(SAMPLES_PER_HIGHEST_HARMONIC * int(harmonic.max() + 1))
            self.recordings.append((part, harmonic, samples))

    def solve(self, network, solve_load: Callable) -> tuple[np.ndarray, np.ndarray]:
        """Set the outflows of `network` to what its nonlinear compliances store.

        `solve_load` maps the line's relation (a, b, c), a p + b q = c, to the load's (p, q).
        Returns that of the solution, each (F,).
        """
        x, volume, compliance = _cells(network)
        line = FundamentalSolutions(network, x)
        laws = []  # (cells, 1 + K) of P and the c_k, for each recording
        for part, _, _ in self.recordings:
            own = [
                (c.pressure[part][0], *c.series[:, part][:, 0])
                for c in network.nonlinear_compliances
            ]
            laws.append(np.array(own)[compliance])

        def stored(outflow):
            pressure = line.pressure_under(solve_load(*line.load_relation(outflow)), outflow)
            flow = np.zeros_like(outflow)
            for law, (part, harmonic, samples) in zip(laws, self.recordings):
                share = _stored_share(law, pressure[:, part], harmonic, samples)
                flow[:, part] = network.s[part] * volume[:, None] * share
            return flow

        outflow = self.find_fixed_point(stored, (len(x), len(network.s)))
        network.outflows = x, outflow
        return solve_load(*line.load_relation(outflow))

    def find_fixed_point(self, function: Callable, shape: tuple) -> np.ndarray:
        """x of `shape` (N, F), complex, with function(x) = x; the last iterate where none is found.

        Starts from the last solution (`warm_start`), then from zero, then from zero in steps of
        CONTINUATION_SHARES.
        """
        self.solved = False
        if self.warm_start and self._outflow is not None and self._outflow.shape == shape:
            value = self._iterate(function, self._outflow)
        for shares in ((1.0,), CONTINUATION_SHARES):
            if self.solved:
                break
            self._accelerations = [AndersonAcceleration() for _ in self.recordings]
            value = np.zeros(shape, complex)
            for share in shares:
                value = self._iterate(function, value, share)
                if not self.solved:
                    break
        self._outflow = value if self.solved else None
        return value

    def _iterate(self, function: Callable, x: np.ndarray, share: float = 1.0) -> np.ndarray:
        """Iterate from x (N, F) to share function(x) = x, at most MAX_PASSES times."""
        parts, reached = [part for part, *_ in self.recordings], np.inf
        for acceleration in self._accelerations:
            acceleration.start()
        for done in range(1, MAX_PASSES + 1):
            value = share * function(x)
            error = max(_relative_change(x[:, part], value[:, part]) for part in parts)
            reached = min(reached, error)
            self.solved = bool(error <= self.tolerance)
            hopeless = done > HOPELESS_PASSES and reached > HOPELESS_CHANGE
            if self.solved or hopeless or not np.isfinite(error):
                break
            x = x.copy()
            for acceleration, part in zip(self._accelerations, parts):
                x[:, part] = acceleration.step(x[:, part], value[:, part])
        return value


def _stored_share(law, pressure, harmonic, samples):
    """Harmonics (cells, H) of the share stored, for those of the pressure; `law` (cells, 1 + K)
    holds P and the c_k."""
    wave = one_period(pressure, samples, harmonic)
    _apply_law(law, wave)
    return peak_amplitudes(wave)[:, harmonic]


@njit(cache=True, error_model="numpy")
def _relative_change(x, value):
    """Largest change from x to `value` (N, F) over the largest value; nan if one is not finite."""
    change = largest = check = 0.0
    for n in range(len(x)):
        for f in range(x.shape[1]):
            v, d = value[n, f], value[n, f] - x[n, f]
            size, moved = v.real**2 + v.imag**2, d.real**2 + d.imag**2
            largest, change, check = max(largest, size), max(change, moved), check + moved
    return np.sqrt(change / max(largest, TINY)) if np.isfinite(check) else np.nan


@njit(cache=True, error_model="numpy")
def _apply_law(law, wave):
    """Replace pressures (cells, samples) by the shares stored."""
    for law_here, row in zip(law, wave):
        for i in range(len(row)):
            x = min(max(row[i] / law_here[0], -MAX_RELATIVE_PRESSURE), MAX_RELATIVE_PRESSURE)
            share = 0.0
            for k in range(len(law_here) - 1, 0, -1):
                share = (share + law_here[k]) * x
            row[i] = share * x


def _cells(network):
    """Middles (N,), m, and volumes, m3, of all cells, and the compliance of each."""
    wavenumber = np.abs(np.sqrt(network.series * network.shunt).imag).max(axis=1)
    ends = np.cumsum(network.lengths)
    x, volume, index = [], [], []
    for n, compliance in enumerate(network.nonlinear_compliances):
        start, length = compliance.start, compliance.stop - compliance.start
        segment = np.searchsorted(ends, start + 0.5 * length)
        wavelengths = length * wavenumber[min(segment, len(ends) - 1)] / (2 * np.pi)
        cells = max(int(np.ceil(wavelengths * CELLS_PER_WAVELENGTH)), 1)
        x.append(start + length / cells * (np.arange(cells) + 0.5))
        volume.append(np.full(cells, compliance.volume / cells))
        index.append(np.full(cells, n))
    return np.concatenate(x), np.concatenate(volume), np.concatenate(index)
