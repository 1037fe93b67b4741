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
    case_leak, cross_leak = leak_conductances(geometry, fluid, fault)
    # Sound chambers at a constant pressure do the same one after another: one is enough.
    alike = isinstance(outlet, ConstantPressure) and not (case_leak.any() or cross_leak.any())
    simulated = 1 if alike else geometry.pistons
    end_of_step, first_stage = _tables(geometry, fluid, period, steps, simulated)
    constants = (
        geometry.bulk_modulus,
        geometry.air_fraction,
        geometry.case_leakage,
        absolute(geometry.suction_pressure),
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
    delivering = np.arange(simulated) * 2 > geometry.pistons
    state = np.append(
        np.where(delivering, load_pressure, absolute(geometry.suction_pressure)), load_pressure
    )

    previous, change = None, np.inf
    for revolutions in range(1, MAX_REVOLUTIONS + 1):  # noqa: B007 (reported)
        flow, pressures, readings = chambers.simulate_revolution(
            state, end_of_step, first_stage, period / steps, constants, case_leak[:simulated],
            cross_leak[:simulated], (zc, half, k_v, behind), line_p, line_q, sensors, given,
        )  # fmt: skip
        if alike:
            flow, pressures = _all_chambers(flow, pressures, geometry.pistons)
        if not np.isfinite(flow).all():
            raise ArithmeticError(f"the chamber equations did not converge at {speed_rpm} r/min")
        if previous is not None:
            change = np.max(np.abs(flow - previous)) / np.std(flow)
        if change < PERIODIC_CHANGE:
            break
        previous = flow
        if isinstance(outlet, Pipe) and outlet.orifice is None:
            k_v = orifice_coefficient(outlet, flow.mean())
    pressures, readings = pressures - ATMOSPHERE, readings - ATMOSPHERE

    def sample(values):  # values at the end of each step -> at the output's angles
        return resample_period(np.roll(values, 1, axis=0).T, samples_per_revolution)

    return PumpRipple(
        angle_deg=np.arange(samples_per_revolution) * 360.0 / samples_per_revolution,
        flow=sample(flow),
        pressure_mean=float(pressures[:, -1].mean()),
        outlet_pressure=sample(pressures[:, -1]),
        chamber_pressure=sample(pressures[:, :-1]),
        sensor_pressure=sample(readings),
        converged=bool(change < PERIODIC_CHANGE),
        change=float(change),
        revolutions=revolutions,
        orifice=float(k_v) if cells else None,
        geometry=geometry,
        density=fluid.density,
    )


def _all_chambers(flow, pressures, pistons):
    """Flow (K,) and pressures (K, n + 1) of n chambers that do the same one after another, from
    those of the first: (K,) and (K, 2)."""
    lag = len(flow) // pistons
    chambers = [np.roll(pressures[:, 0], k * lag) for k in range(pistons)]
    total = np.tile(flow.reshape(pistons, lag).sum(axis=0), pistons)
    return total, np.stack([*chambers, pressures[:, -1]], axis=1)


def _tables(geometry, fluid, period, steps, count):
    """Volumes, their rates and port conductances (K, 4, n) of the first n = `count` chambers at the
    steps' ends and first stages."""
    lag = 2 * np.pi * np.arange(count) / geometry.pistons
    tables = []
    for fraction in (1.0, chambers.GAMMA):
        phi = 2 * np.pi * (np.arange(steps) + fraction)[:, None] / steps - lag
        columns = [
            geometry.volume(phi),
            geometry.volume_slope(phi) * 2 * np.pi / period,
            orifice_conductance(geometry, fluid, geometry.delivery_area(phi)),
            orifice_conductance(geometry, fluid, geometry.suction_area(phi)),
        ]
        tables.append(np.ascontiguousarray(np.stack(columns, axis=1)))
    return tables
