"""Where on a grid a position of the line is read, and the exact line over what is left.

A position lies in one piece of the line, on an edge in the piece on the pump's side. A pipe is read
at its nearest node. A piece that is too short for cells is a part of a ladder: it is read at the
rung with which it begins. From there to the position the pressure and the flow, which are periodic,
go through the exact line of that very piece, in the frequency domain.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rippletwin.line.frequency_domain.pipe_immittance import series_impedance, shunt_admittance
from rippletwin.line.time_domain.discretisation import SAME_POSITION
from rippletwin.line.time_domain.line_elements import Pipe, TimeDomainLine

if TYPE_CHECKING:
    from rippletwin.line.time_domain.grid import Grid


class Place(NamedTuple):
    """A `node`, or ~r for the pump's side of rung r (see `moc_kernel.advance`), and the position's
    distance from it, `offset` in m towards the load, in `pipe` with its steady `resistance`, Pa
    s/m4."""

    node: int
    offset: float
    pipe: Pipe
    resistance: float


def locate(grid: Grid, x: float) -> Place:
    """The place where position `x`, m, is read. Raises ValueError for x outside the line."""
    line = grid.line
    if not -1e-12 <= x <= line.length * (1 + 1e-12):
        raise ValueError(f"position {x} m lies outside the line of {line.length} m")
    if x <= SAME_POSITION and grid.outlet is not None:
        return Place(~grid.outlet, 0.0, line.pipes[0], 0.0)
    ends = [start + pipe.length for start, pipe, _ in grid.pieces]
    ends[-1] = np.inf
    n = next(n for n, end in enumerate(ends) if x <= end + SAME_POSITION)
    start, pipe, k = grid.pieces[n]
    if k < 0:  # its elements respond to the deviation from the steady state, which has no drop
        return Place(k, _beyond_rounding(x - start), pipe, 0.0)
    nodes = np.arange(grid.offsets[k], grid.offsets[k + 1])
    node = int(nodes[np.argmin(np.abs(grid.x[nodes] - x))])
    resistance = 2.0 * grid.parameters[k, 1] / (pipe.wave_speed * grid.dt)
    return Place(node, _beyond_rounding(x - grid.x[node]), pipe, float(resistance))


def shift(
    line: TimeDomainLine, place: Place, pressure: np.ndarray, flow: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Periodic pressure, Pa, and flow, m3/s, (M,) at the node or rung of `place`, by its offset
    further on."""
    pipe, offset = place.pipe.linear(line.density), place.offset
    p, q = np.fft.rfft(pressure), np.fft.rfft(flow)
    s = 2j * np.pi * np.arange(1, len(p)) / line.period
    fluid = {"density": line.density, "diameter": pipe.diameter}
    z = series_impedance(s, viscosity=line.viscosity, friction=line.friction, **fluid)
    y = shunt_admittance(s, wave_speed=pipe.wave_speed, **fluid) * pipe.yielding(s)
    gamma, zc = np.sqrt(z * y), np.sqrt(z / y)
    c, d = np.cosh(gamma * offset), np.sinh(gamma * offset)
    p[0] -= place.resistance * offset * q[0]
    p[1:], q[1:] = c * p[1:] - zc * d * q[1:], c * q[1:] - d / zc * p[1:]
    return np.fft.irfft(p, len(pressure)), np.fft.irfft(q, len(flow))


def _beyond_rounding(offset: float) -> float:
    """The offset, zero where it is none but rounding."""
    return 0.0 if abs(offset) < SAME_POSITION else float(offset)
