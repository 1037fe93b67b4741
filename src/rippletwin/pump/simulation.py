"""The pump delivering into an outlet, healthy or with leaks, until it is periodic."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import resample

from rippletwin.case.model import FlowRipple, Fluid, Segment
from rippletwin.pump import chambers
from rippletwin.pump.geometry import Geometry
from rippletwin.pump.source import source_admittance

MIN_STEPS = 12288  # a revolution: the ripple moves by far less than 1 % when they are doubled
MAX_REVOLUTIONS = 80
PERIODIC = 1e-6  # largest change from one revolution to the next, relative to the ripple's rms
DELAY_TOLERANCE = 1e-5  # relative, of the pipe's travel time as a whole number of steps


@dataclass(frozen=True)
class Slipper:
    """A worn slipper: `piston`'s chamber leaks to the case through `leak_area` (m2)."""

    leak_area: float
    piston: int = 0


@dataclass(frozen=True)
class Cylinder:
    """A scratched cylinder block: `leak_area` (m2) joins `piston`'s chamber and the next one's."""

    leak_area: float
    piston: int = 0


@dataclass(frozen=True)
class ConstantPressure:
    """An outlet held at `pressure` (Pa, absolute)."""

    pressure: float


@dataclass(frozen=True)
class PressureWave:
    """An outlet whose pressure (M,), Pa absolute, is given at M even angles of a revolution."""

    pressure: np.ndarray


@dataclass(frozen=True)
class Pipe:
    """A uniform pipe with steady laminar friction and an orifice q = K_v sqrt(p) at its end.

    Give either `load_pressure` (Pa), the pressure upstream of the orifice at the mean flow, from
    which K_v follows, or K_v itself as `orifice` (m3/s/sqrt(Pa)): a faulty pump meets the orifice
    that the healthy one left. Sensors at `sensor_positions` (m from the pump).
    """

    segment: Segment
    sensor_positions: tuple[float, ...] = ()
    load_pressure: float | None = None
    orifice: float | None = None

    def __post_init__(self):
        if (self.load_pressure is None) == (self.orifice is None):
            raise ValueError("give either load_pressure or orifice")
        if not all(0.0 <= x <= self.segment.length for x in self.sensor_positions):
            raise ValueError("a sensor lies outside the pipe")


@dataclass(frozen=True)
class PumpRipple(FlowRipple):
    """A FlowRipple with what else the simulation knows, over one revolution of M samples.

    outlet_pressure (M,), chamber_pressure (pistons, M), sensor_pressure (S, M), all Pa.
    `converged` tells whether the solution is periodic: `change`, from the last revolution but
    one to the last relative to the ripple's rms, is within the tolerance after `revolutions`.
    `orifice` is K_v of the pipe's load, None at a constant pressure.
    """

    outlet_pressure: np.ndarray | None = None
    chamber_pressure: np.ndarray | None = None
    sensor_pressure: np.ndarray | None = None
    converged: bool = False
    change: float = np.nan
    revolutions: int = 0
    orifice: float | None = None
    geometry: Geometry | None = None
    density: float | None = None

    def source_admittance(self, s: np.ndarray) -> np.ndarray:
        """Admittance (F,), m3/s/Pa, that the chambers add beside the flow into a constant pressure.

        Zero for a ripple coupled to a pipe, whose flow has already answered a line.
        """
        if self.orifice is not None:
            return super().source_admittance(s)
        return source_admittance(
            self.geometry, self.density, self.pressure_mean, self.chamber_pressure, s
        )

    def source_capacitance(self, frequency_hz: float) -> float:
        """The same as a capacitance in m3/Pa, at the pumping frequency, say: Im Y/w.

        Its real part, the ports' loss, is some per cent of it up to ten times that frequency.
        """
        s = np.array([2j * np.pi * frequency_hz])
        return float(self.source_admittance(s)[0].imag / s[0].imag)


def simulate(
    pump: dict,
    fluid: Fluid,
    speed_rpm: float,
    outlet: ConstantPressure | PressureWave | Pipe,
    fault: Slipper | Cylinder | Sequence[Slipper | Cylinder] | None = None,
    samples_per_revolution: int = 3072,
    min_steps: int = MIN_STEPS,
) -> PumpRipple:
    """Flow ripple of the pump over one revolution, starting with piston 0 at outer dead centre.

    `pump` holds the keys of `Geometry`; `speed_rpm` is r/min; `fault` is one fault or several
    together. The solver makes at least `min_steps` steps a revolution, and the result is
    band-limited from these to `samples_per_revolution`. Raises ValueError for impossible input
    and ArithmeticError where the chamber equations cannot be solved.
    """
    geometry = Geometry.from_dict(pump)
    period = 60.0 / speed_rpm
    steps, cells = _steps(geometry.pistons, period, outlet, max(min_steps, samples_per_revolution))
    case_leak, cross_leak = _leaks(geometry, fluid, fault)
    end_of_step, first_stage = _tables(geometry, fluid, period, steps)
    constants = (
        geometry.bulk_modulus,
        geometry.air_fraction,
        geometry.case_leakage,
        geometry.suction_pressure,
    )

    mean_flow = geometry.displacement / period
    line, line_p, line_q, sensors = _line(fluid, outlet, period / steps, cells, mean_flow)
    given = np.zeros(0) if cells else _at_steps(outlet.pressure, steps)
    load_pressure = line_p[0] if cells else given.mean()
    delivering = np.arange(geometry.pistons) * 2 > geometry.pistons
    state = np.append(np.where(delivering, load_pressure, geometry.suction_pressure), load_pressure)

    previous, change = None, np.inf
    for revolutions in range(1, MAX_REVOLUTIONS + 1):  # noqa: B007 (reported)
        flow, pressures, readings = chambers.revolution(
            state, end_of_step, first_stage, period / steps, constants, case_leak, cross_leak,
            line, line_p, line_q, sensors, given,
        )  # fmt: skip
        if not np.isfinite(flow).all():
            raise ArithmeticError(f"the chamber equations did not converge at {speed_rpm} r/min")
        if previous is not None:
            change = np.max(np.abs(flow - previous)) / np.std(flow)
        if change < PERIODIC:
            break
        previous = flow
        if cells and outlet.orifice is None:
            line = (line[0], line[1], flow.mean() / np.sqrt(outlet.load_pressure))

    def sample(values):  # values at the end of each step -> at the output's angles
        return _resample(np.roll(values, 1, axis=0), samples_per_revolution).T

    return PumpRipple(
        angle_deg=np.arange(samples_per_revolution) * 360.0 / samples_per_revolution,
        flow=sample(flow),
        pressure_mean=float(pressures[:, -1].mean()),
        outlet_pressure=sample(pressures[:, -1]),
        chamber_pressure=sample(pressures[:, :-1]),
        sensor_pressure=sample(readings),
        converged=bool(change < PERIODIC),
        change=float(change),
        revolutions=revolutions,
        orifice=float(line[2]) if cells else None,
        geometry=geometry,
        density=fluid.density,
    )


def _steps(pistons, period, outlet, least):
    """Steps a revolution and cells of the pipe.

    A multiple of the pistons, so that all of them see the same angles, and such that a wave needs
    a whole number of steps for the pipe: the method of characteristics then needs neither
    interpolation nor an altered wave speed.
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


def _leaks(geometry, fluid, fault):
    """Conductances (pistons,) from each chamber to the case and to the next chamber."""
    faults = [] if fault is None else [fault] if isinstance(fault, Slipper | Cylinder) else fault
    case_leak, cross_leak = np.zeros((2, geometry.pistons))
    for item in faults:
        leak = case_leak if isinstance(item, Slipper) else cross_leak
        leak[item.piston % geometry.pistons] += _conductance(geometry, fluid, item.leak_area)
    return case_leak, cross_leak


def _conductance(geometry, fluid, area):
    return geometry.discharge_coefficient * area * np.sqrt(2 / fluid.density)


def _tables(geometry, fluid, period, steps):
    """Volumes, their rates and port conductances at steps' ends and at first stages (K, 4, n)."""
    lag = 2 * np.pi * np.arange(geometry.pistons) / geometry.pistons
    tables = []
    for fraction in (1.0, chambers.GAMMA):
        phi = 2 * np.pi * (np.arange(steps) + fraction)[:, None] / steps - lag
        columns = [
            geometry.volume(phi),
            geometry.volume_slope(phi) * 2 * np.pi / period,
            _conductance(geometry, fluid, geometry.delivery_area(phi)),
            _conductance(geometry, fluid, geometry.suction_area(phi)),
        ]
        tables.append(np.ascontiguousarray(np.stack(columns, axis=1)))
    return tables


def _line(fluid, outlet, step, cells, mean_flow):
    """Constants of the line, its steady state at `mean_flow`, and the sensors' nodes and weights.

    Sensors between nodes read a cubic through the four nearest ones.
    """
    if not cells:
        empty = np.zeros(0)
        return (0.0, 0.0, 0.0), empty, empty, np.zeros((0, 5))
    segment = outlet.segment
    zc = fluid.density * segment.wave_speed / segment.area
    viscosity = fluid.density * fluid.kinematic_viscosity
    friction = 128 * viscosity / (np.pi * segment.diameter**4)  # Hagen-Poiseuille, Pa s/m4
    half = 0.5 * friction * segment.length / cells
    k_v = outlet.orifice or mean_flow / np.sqrt(outlet.load_pressure)
    drop = friction * segment.length * mean_flow
    line_p = (mean_flow / k_v) ** 2 + drop * np.linspace(1.0, 0.0, cells + 1)
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


def _at_steps(pressure, steps):
    """The outlet's pressure at the end of each step, (steps,)."""
    if np.ndim(pressure) == 0:
        return np.full(steps, float(pressure))
    return np.roll(resample(np.asarray(pressure, float), steps), -1)


def _resample(values, samples):
    """Values (K, ...) over a period to `samples` <= K, keeping the harmonics both can hold."""
    spectrum = np.fft.rfft(values, axis=0)[: samples // 2 + 1]
    if samples % 2 == 0 and samples < len(values):
        spectrum[-1] = 0.0
    return np.fft.irfft(spectrum, samples, axis=0) * (samples / len(values))
