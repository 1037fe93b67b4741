"""The pump delivering into an outlet, healthy or with leaks, until it is periodic.

Pressures that go in and come out are gauge pressures. The chambers' equations need absolute ones,
for the air in the oil; `simulate` is where one becomes the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rippletwin.case.model import ATMOSPHERE, FlowRipple, Fluid, absolute
from rippletwin.harmonics import resample_period
from rippletwin.pump import chambers
from rippletwin.pump.faults import Cylinder, Slipper, leak_conductances, orifice_conductance
from rippletwin.pump.geometry import Geometry
from rippletwin.pump.outlets import (
    ConstantPressure,
    Pipe,
    PressureWave,
    choose_steps,
    orifice_coefficient,
    pipe_state,
    pressure_at_steps,
)
from rippletwin.pump.source_admittance import source_admittance

MIN_STEPS = 12288  # a revolution: doubled, the ripple changes by far less than 1 %
MAX_REVOLUTIONS = 80
PERIODIC_CHANGE = 1e-6  # between revolutions, relative to the ripple's rms


@dataclass(frozen=True)
class PumpRipple(FlowRipple):
    """A FlowRipple with the other results of the simulation, over one revolution of M samples.

    outlet_pressure (M,), chamber_pressure (pistons, M), sensor_pressure (S, M), all Pa gauge.
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

    @property
    def meets_ripple(self) -> bool:
        """Whether the pressure at the outlet changes within a revolution, by more than rounding."""
        assert self.outlet_pressure is not None  # a result of `simulate`
        return bool(np.ptp(self.outlet_pressure) > 1e-9 * np.max(np.abs(self.outlet_pressure)))

    def source_admittance(self, s: np.ndarray) -> np.ndarray:
        """Admittance (F,), m3/(Pa s), of the chambers, beside the flow into a constant pressure.

        Zero for a ripple coupled to a pipe, whose flow contains the response to a line. The result
        is kept with the ripple and read-only, since fits need the same frequencies very often.
        """
        if self.orifice is not None:
            return super().source_admittance(s)
        key, known = np.asarray(s, complex).tobytes(), self._known_admittances
        if key not in known:
            known[key] = source_admittance(
                self.geometry, self.density, self.pressure_mean, self.chamber_pressure, s
            )
            known[key].flags.writeable = False
        return known[key]

    @cached_property
    def _known_admittances(self) -> dict[bytes, np.ndarray]:
        return {}

    def source_capacitance(self, frequency_hz: float) -> float:
        """The source admittance as a capacitance, Im Y/w, m3/Pa; its real part, the ports' loss, is
        some per cent of it up to ten times the pumping frequency."""
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
    steps, cells = choose_steps(
        geometry.pistons, period, outlet, max(min_steps, samples_per_revolution)
    )
    mean_flow = geometry.displacement / period
    (zc, half, k_v), line_p, line_q, sensors = pipe_state(
        fluid, outlet, period / steps, cells, mean_flow
    )
    line_p, behind, given = absolute(line_p), absolute(0.0), np.zeros(0)
    if isinstance(outlet, Pipe):
        behind = absolute(outlet.back_pressure)
    else:
        given = absolute(pressure_at_steps(outlet.pressure, steps))
    load_pressure = line_p[0] if cells else given.mean()
    chamber_groups = _ChamberGroups(geometry, fluid, fault, outlet, period, steps, load_pressure)

    previous, change = None, np.inf
    for revolutions in range(1, MAX_REVOLUTIONS + 1):  # noqa: B007 (reported)
        flow, readings = chamber_groups.turn(
            (zc, half, k_v, behind), line_p, line_q, sensors, given
        )
        if not np.isfinite(flow).all():
            raise ArithmeticError(f"the chamber equations did not converge at {speed_rpm} r/min")
        if previous is not None:
            change = np.max(np.abs(flow - previous)) / np.std(flow)
        if change < PERIODIC_CHANGE:
            break
        previous = flow
        if isinstance(outlet, Pipe) and outlet.orifice is None:
            k_v = orifice_coefficient(outlet, flow.mean())
    pressures, readings = chamber_groups.pressures() - ATMOSPHERE, readings - ATMOSPHERE

    def sample(values):  # values at the end of each step -> at the output's angles
        return resample_period(np.roll(values, 1, axis=-1), samples_per_revolution)

    return PumpRipple(
        angle_deg=np.arange(samples_per_revolution) * 360.0 / samples_per_revolution,
        flow=sample(flow),
        pressure_mean=float(pressures[-1].mean()),
        outlet_pressure=sample(pressures[-1]),
        chamber_pressure=sample(pressures[:-1]),
        sensor_pressure=sample(readings),
        converged=bool(change < PERIODIC_CHANGE),
        change=float(change),
        revolutions=revolutions,
        orifice=float(k_v) if cells else None,
        geometry=geometry,
        density=fluid.density,
    )


class _ChamberGroups:
    """The chambers over a revolution of K steps, those that affect each other in one group.

    At a constant pressure chambers affect each other through cross leaks alone, and those that do
    not leak do the same one after another: one of them, `group[0] in alike`, stands for all.
    """

    def __init__(self, geometry, fluid, fault, outlet, period, steps, load_pressure):
        self._pistons, self._step = geometry.pistons, period / steps
        self._case_leak, self._cross_leak = leak_conductances(geometry, fluid, fault)
        suction = absolute(geometry.suction_pressure)
        self._constants = (
            geometry.bulk_modulus, geometry.air_fraction, geometry.case_leakage, suction
        )  # fmt: skip
        everyone = np.arange(geometry.pistons)
        joined = (self._cross_leak > 0.0) | (np.roll(self._cross_leak, 1) > 0.0)
        leaking = joined | (self._case_leak > 0.0)
        self._alike = everyone[~leaking]
        if isinstance(outlet, ConstantPressure) and len(self._alike):
            ring = np.roll(everyone, -self._alike[0])  # those that are joined stay neighbours
            groups = [group for group in (self._alike[:1], ring[leaking[ring]]) if len(group)]
        else:
            groups, self._alike = [everyone], everyone[:0]
        self._groups = []  # of each: its chambers, their state and tables
        for group in groups:
            start = np.where(group * 2 > geometry.pistons, load_pressure, suction)
            state = np.append(start, load_pressure)
            self._groups.append((group, state, _tables(geometry, fluid, period, steps, group)))

    def turn(self, line, line_p, line_q, sensors, outlet):
        """One revolution; arguments as of `chambers.simulate_revolution`.

        Returns flow (K,) and sensor pressures (S, K), each at a step's end.
        """
        flow, self._last = 0.0, []
        for group, state, (end_of_step, first_stage) in self._groups:
            delivered, pressures, readings = chambers.simulate_revolution(
                state, end_of_step, first_stage, self._step, self._constants,
                self._case_leak[group], self._cross_leak[group], line, line_p, line_q, sensors,
                outlet,
            )  # fmt: skip
            self._last.append(np.ascontiguousarray(pressures.T))
            if group[0] in self._alike:
                flow = flow + sum(delayed for _, delayed in self._one_after_another(delivered))
            else:
                flow = flow + delivered
        return flow, readings.T

    def pressures(self) -> np.ndarray:
        """Pressures (n + 1, K), Pa, of the n chambers and the outlet in the last revolution."""
        found = np.empty((self._pistons + 1, self._last[0].shape[1]))
        for (group, _, _), (*own, found[-1]) in zip(self._groups, self._last):
            if group[0] in self._alike:
                for k, delayed in self._one_after_another(own[0]):
                    found[k] = delayed
            else:
                found[group] = own
        return found

    def _one_after_another(self, values):
        """Chambers that are alike, each with `values` (K,) of the first as much later as it is."""
        count, twice = len(values), np.concatenate([values, values])
        for k in self._alike:
            lag = (k - self._alike[0]) * count // self._pistons
            yield k, twice[count - lag : 2 * count - lag]


def _tables(geometry, fluid, period, steps, group):
    """Volumes, their rates and port conductances (K, 4, n) of the n chambers of `group` at the
    steps' ends and first stages."""
    lag = 2 * np.pi * group / geometry.pistons
    tables = []
    for fraction in (1.0, chambers.GAMMA):
        phi = 2 * np.pi * (np.arange(steps) + fraction)[:, None] / steps - lag
        ports = [
            orifice_conductance(fluid, area, geometry.discharge_coefficient)
            for area in (geometry.delivery_area(phi), geometry.suction_area(phi))
        ]
        columns = [geometry.volume(phi), geometry.volume_slope(phi) * 2 * np.pi / period, *ports]
        tables.append(np.ascontiguousarray(np.stack(columns, axis=1)))
    return tables
