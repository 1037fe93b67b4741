"""The line in the time domain by the method of characteristics (Wylie & Streeter 1993, ch. 3).

Pipes meet at junctions. A pipe of length L is divided into cells of exactly a dt, through which
p + Zc q and p - Zc q travel unchanged but for the losses, and one last cell of theta in [2, 3) such
steps for the rest. Through it the waves are delayed by theta dt: their last four values are
interpolated by Lagrange's cubic, which is passive for these theta and exact at theta = 2. So no
wave speed is rounded to the grid, whatever dt. Over a cell the losses are trapezoidal:

    p + Zc q = [p + Zc q]_foot - dx/2 (f + f_foot) - dt/2 sum_k kappa_k (e_k' + e_k'_foot)

f = (rho/A)((8 nu/R^2) q + (4 nu/R^2) sum_k y_k): steady friction and the recursion of
`weighting_functions` for the unsteady part, both implicit at the new point. e_k' = (p - e_k)/tau_k:
the retarded strains of a wall or fluid with Y' = A s/(rho a^2) (1 + sum_k kappa_k/(1 + s tau_k)),
integrated exactly for a p that is linear within the step. Elements at a junction are discretised
by the trapezoidal rule and solved with the pipes at each step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rippletwin.harmonics import peak_amplitudes
from rippletwin.line.frequency_domain.pipe_immittance import FRICTION_LAWS
from rippletwin.line.time_domain.grid import Grid
from rippletwin.line.time_domain.line_elements import Pipe, TimeDomainLine
from rippletwin.line.time_domain.places import locate, shift


@dataclass(frozen=True)
class Transient:
    """The last period at the positions asked for.

    pressure, flow   (S, M) Pa and m3/s, M steps a period; the pressure as the sensors read it
    change           largest change of the pressure anywhere on the line from the period before,
                     over the largest rms ripple among the positions and the line's two ends
    worst_position   where that is, m from the pump (of the junction, within a branch)
    converged        change below the tolerance
    periods          how many were computed
    remainder        (n,) part of each segment beyond whole cells, in cells, [0, 1)
    """

    pressure: np.ndarray
    flow: np.ndarray
    change: float
    worst_position: float
    converged: bool
    periods: int
    remainder: np.ndarray

    def harmonics(self, orders: np.ndarray) -> np.ndarray:
        """Peak complex amplitudes (S, F), Pa, of the pressure at whole `orders` (F,)."""
        return peak_amplitudes(self.pressure)[:, orders]


def steps_a_period(segments: Sequence[Pipe], period: float, at_least: int) -> int:
    """Steps a `period`, s, from `at_least` to a tenth more, that leave the smallest remainders of a
    cell in the segments."""
    steps = np.arange(at_least, at_least + max(at_least // 10, 1))
    cells = np.array([p.length / p.wave_speed for p in segments])[:, None] * steps / period
    rest = cells % 1.0
    return int(steps[np.argmin(np.sum(rest * (1.0 - rest), axis=0))])


def simulate(line: TimeDomainLine, periods: int = 60, tolerance: float = 1e-6) -> Transient:
    """Simulate the line driven by its periodic flow, at steps of period/M, until it is periodic.

    Starts from the steady flow of the mean and stops when `tolerance` or `periods` is reached.

    Raises ValueError for an unknown friction or end, a position outside the line, a mean flow
    into a closed end, or a line or branch shorter than three steps (take more steps a period).
    """
    if line.friction not in FRICTION_LAWS:
        raise ValueError(f"friction must be one of {FRICTION_LAWS}, not {line.friction!r}")
    grid = Grid(line)
    places = [locate(grid, x) for x in line.positions]
    nodes = np.array([place.node for place in places] + [0, grid.load_node], dtype=np.int64)

    before = grid.pressure.copy()
    done, change, worst = 0, np.inf, 0
    while done < periods and not change < tolerance:
        pressure, rate = grid.advance(nodes)
        done += 1
        ripple = np.max(np.std(pressure, axis=1))
        difference = np.abs(grid.pressure - before)
        worst = int(np.argmax(difference))
        change = difference[worst] / ripple if ripple > 0 else difference[worst]
        before = grid.pressure.copy()

    for k, place in enumerate(places):
        if place.offset != 0.0:
            pressure[k], rate[k] = shift(line, place, pressure[k], rate[k])
    for k, factor in line.sensors:
        pressure[k] = _apply_filter(factor, pressure[k], line.period)
    dt = line.period / len(line.flow)
    return Transient(
        pressure=pressure[:-2],
        flow=rate[:-2],
        change=float(change),
        worst_position=float(grid.x[worst]),
        converged=bool(change < tolerance),
        periods=done,
        remainder=np.array([p.length / (p.wave_speed * dt) % 1 for p in line.pipes]),
    )


def _apply_filter(factor, signal: np.ndarray, period: float) -> np.ndarray:
    """A periodic signal (M,) after a linear filter H(s), harmonic by harmonic."""
    spectrum = np.fft.rfft(signal)
    s = 2j * np.pi * np.arange(len(spectrum)) / period
    return np.fft.irfft(spectrum * factor(s), len(signal))
