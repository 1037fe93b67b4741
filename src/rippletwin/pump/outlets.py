"""What the pump delivers into: a constant pressure, a given pressure, or a pipe with an orifice.

Pressures are gauge pressures.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rippletwin.case.model import Segment
from rippletwin.harmonics import resample_period

DELAY_TOLERANCE = 1e-5  # relative, of the pipe's travel time as a whole number of steps


@dataclass(frozen=True)
class ConstantPressure:
    """An outlet held at `pressure`, Pa."""

    pressure: float


@dataclass(frozen=True)
class PressureWave:
    """An outlet whose pressure (M,), Pa, is given at M even angles of a revolution."""

    pressure: np.ndarray


@dataclass(frozen=True)
class Pipe:
    """A uniform pipe with steady laminar friction and an orifice q = K_v sqrt(p - p0) at its end.

    Give either `load_pressure` (Pa), the pressure upstream of the orifice at the mean flow, from
    which K_v follows, or K_v itself as `orifice` (m3/s/sqrt(Pa)): a faulty pump meets the orifice
    that the healthy one left. p0 is `back_pressure`, Pa. Sensors at `sensor_positions` (m from the
    pump).

    Raises ValueError unless one of both is given, for a load pressure that is not above the back
    pressure, and for a sensor outside the pipe.
    """

    segment: Segment
    sensor_positions: tuple[float, ...] = ()
    load_pressure: float | None = None
    orifice: float | None = None
    back_pressure: float = 0.0

    def __post_init__(self):
        if (self.load_pressure is None) == (self.orifice is None):
            raise ValueError("give either load_pressure or orifice")
        if self.load_pressure is not None and not self.load_pressure > self.back_pressure:
            raise ValueError("load_pressure must be above back_pressure")
        if not all(0.0 <= x <= self.segment.length for x in self.sensor_positions):
            raise ValueError("a sensor lies outside the pipe")


def choose_steps(pistons, period, outlet, least):
    """Steps a revolution, and cells of the pipe, 0 where the outlet is none.

    pistons   of the pump
    period    of a revolution, s
    outlet    `ConstantPressure`, `PressureWave` or `Pipe`
    least     steps a revolution at least

    The steps are a multiple of the pistons, so that all of these have the same angles, and such
    that a wave takes a whole number of steps through the pipe: the method of characteristics then
    needs neither interpolation nor an altered wave speed. Raises ValueError for a pipe that is too
    short for so few steps.
    """
    first = -(-least // pistons) * pistons
    if not isinstance(outlet, Pipe):
        return first, 0
    candidates = first + pistons * np.arange(max(first // pistons, 1))
    cells = outlet.segment.delay * candidates / period
    error = np.abs(cells - np.rint(cells)) / cells
    good = np.flatnonzero((error < DELAY_TOLERANCE) & (cells > 3.5))
    if not len(good):
        raise ValueError(f"a pipe of {outlet.segment.length} m is too short for {least} steps")
    return int(candidates[good[0]]), int(np.rint(cells[good[0]]))


def orifice_coefficient(outlet: Pipe, mean_flow: float) -> float:
    """K_v, m3/s/sqrt(Pa), that lets `mean_flow` (m3/s) pass at the pipe's load pressure."""
    return mean_flow / np.sqrt(outlet.load_pressure - outlet.back_pressure)


def pipe_state(fluid, outlet, step, cells, mean_flow):
    """Constants of the line, its steady state at `mean_flow`, m3/s, and the sensors' nodes.

    Returns (characteristic impedance and half the friction of a cell in Pa s/m3, K_v of the orifice
    in m3/s/sqrt(Pa)), pressure, Pa, and flow, m3/s, (cells + 1,), and (S, 5) the first of four
    nodes and their weights: sensors between nodes read a cubic through the four nearest ones. All
    are empty or zero without cells.
    """
    if not cells:
        empty = np.zeros(0)
        return (0.0, 0.0, 0.0), empty, empty, np.zeros((0, 5))
    segment = outlet.segment
    zc = fluid.density * segment.wave_speed / segment.area
    viscosity = fluid.density * fluid.kinematic_viscosity
    friction = 128 * viscosity / (np.pi * segment.diameter**4)  # Hagen-Poiseuille, Pa s/m4
    half = 0.5 * friction * segment.length / cells
    k_v = outlet.orifice or orifice_coefficient(outlet, mean_flow)
    drop = friction * segment.length * mean_flow
    at_load = outlet.back_pressure + (mean_flow / k_v) ** 2
    line_p = at_load + drop * np.linspace(1.0, 0.0, cells + 1)
    line_q = np.full(cells + 1, mean_flow)

    sensors = np.zeros((len(outlet.sensor_positions), 5))
    for row, x in zip(sensors, outlet.sensor_positions):
        node = x / segment.length * cells
        row[0] = np.clip(np.floor(node) - 1, 0, cells - 3)
        u = node - row[0]
        for m in range(4):
            others = np.delete(np.arange(4), m)
            row[1 + m] = np.prod((u - others) / (m - others))
    return (zc, half, k_v), line_p, line_q, sensors


def pressure_at_steps(pressure, steps):
    """The outlet's pressure, Pa, at the end of each step, (steps,), of one number or of a period at
    even angles (M,)."""
    if np.ndim(pressure) == 0:
        return np.full(steps, float(pressure))
    return np.roll(resample_period(np.asarray(pressure, float), steps), -1)
