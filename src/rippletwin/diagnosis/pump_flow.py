"""What a leak changes in the flow of the pump, at every shaft order and for every leak area.

The lumped pump is simulated at a few leak areas. The change of flow over the area is smooth in the
logarithm of the area, so that a spline through these gives all others. The pump delivers into a
constant pressure: against the ripple of its line the change differs by less than 1 %, far below
what a leak's own law is uncertain by.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from scipy.interpolate import CubicSpline, make_interp_spline

from rippletwin.case.model import Fluid, Rig
from rippletwin.diagnosis.faults.base import Fault
from rippletwin.errors import InputError
from rippletwin.harmonics import peak_amplitudes
from rippletwin.pump.geometry import Geometry, stated_numbers
from rippletwin.pump.outlets import ConstantPressure
from rippletwin.pump.simulation import PumpRipple, simulate
from rippletwin.twin.twin import Twin

STEPS = 3072  # a revolution: the change moves by 0.3 % when they are doubled, 1 % at 1e-8 m2
NODES = 21  # leak areas that are simulated, a factor of 1.5 apart
ORDERS = 600  # highest shaft order whose flow is kept
KEPT_FLOWS, KEPT_RIPPLES = 64, 256  # 0.5 and 0.3 MB each
SLOPE_NODES = slice(2, None, 4)  # of these areas, at which slopes by the pump's numbers are taken
UNCERTAIN = {
    "bulk_modulus": 0.08,
    "dead_volume": 0.15,
    "port_area": 0.17,  # and with it the ports' discharge coefficient; leaks have one of their own
    "port_opening_deg": 0.15,
    "air_fraction": 0.7,
}
"""Relative standard deviations of the numbers of a pump about those of its data sheet."""
TIMING_SD_DEG = 0.5  # of the port plate
NUMBERS = (*UNCERTAIN, "port_timing_deg")  # in the order of `moved_pumps`


def with_fitted_pump(twin: Twin, displacement: float | None = None) -> Twin:
    """The twin with its pump's numbers as fitted, and neither they nor shaft angles and states of
    recordings parameters: those between two recordings belong to the diagnosis.

    Where the data sheet gives the number of pistons alone, the default pump is scaled to a
    `displacement`, m3 a revolution, by default that of the recordings' flow ripples.
    """
    pump = stated_numbers(twin.rig.pump)
    displacement = displacement or twin.rig.displacement
    if set(pump) == {"pistons"} and displacement is not None:
        pump = _default_pump(pump, displacement)
    own = {"viscosity_slope", *(p.name for p in twin.parameters if p.place == "pump")}
    own.update(f"{kind}[{label}]" for label in twin.labels for kind in ("angle", "state"))
    fitted = stated_numbers(twin.fitted_pump())
    pump = _with_stated_discharge(pump | fitted, pump.get("discharge_coefficient"))
    kept = [name not in own for name in twin.index]
    return rebuild(twin, replace(twin.rig, pump=pump), theta=twin.theta[kept])


def rebuild(
    twin: Twin, rig: Rig, observations: Sequence = (), theta: np.ndarray | None = None
) -> Twin:
    """A twin of `rig` and the observations with the friction, effects and source error of `twin`;
    theta (P,), nominal where None."""
    return Twin(
        rig,
        observations,
        friction=twin.friction,
        effects=twin.effects,
        source_sd=twin.source_sd,
        theta=theta,
        guessed_load=twin.guessed_load,
        absolute_gains=twin.absolute_gains,
    )


def _with_stated_discharge(pump: dict, stated: float | None) -> dict:
    """The pump with the discharge coefficient of the data sheet, None where it states none, and the
    same flow through its ports. A coefficient that was fitted is that of the ports, not of leaks.
    """
    fitted = pump.get("discharge_coefficient")
    if fitted in (None, stated):
        return pump
    ratio = fitted / (stated or Geometry.discharge_coefficient)
    area = ratio * Geometry.from_dict(pump).port_area
    return pump | {"port_area": area, "discharge_coefficient": stated}


def load_pressure_of(twin: Twin, observation) -> float:
    """Load pressure, Pa, of an observation: as stated, or as its sensors' means have it.

    Raises InputError where it is not positive: no leak flows then.
    """
    point = twin.operating_point(replace(observation, source="free"))
    pressure = observation.load_pressure or point.load_pressure
    if not pressure > 0.0:
        raise InputError(
            f"recording {observation.label}",
            "load_pressure",
            f"not given, and the mean of the sensors is {pressure:.3g} Pa: no leak flows",
            "Give the mean gauge pressure at the load, Pa",
        )
    return pressure


def _default_pump(pump: dict, displacement: float) -> dict:
    """The default pump of as many pistons, its lengths changed alike so that it has this
    displacement, m3 a revolution. Its other sizes grow with them (`geometry.GROWS_WITH`)."""
    default = Geometry.from_dict(pump)
    ratio = (displacement / default.displacement) ** (1 / 3)
    lengths = {key: ratio * getattr(default, key) for key in ("piston_diameter", "pitch_radius")}
    return pump | lengths


@dataclass(frozen=True)
class LeakFlow:
    """The change of a pump's flow with the area of a leak at piston 0.

    areas    (A,) simulated, m2, ascending
    change   (A, K) change over area of the flow's peak amplitudes at orders 0 to K - 1, m/s
    mean     mean flow of the healthy pump, m3/s
    slopes   (B, P, K) derivatives of `change` by the P `NUMBERS` of the pump, in standard
             deviations, at areas[SLOPE_NODES], as the port plate stands (`plate_turns`)
    periodic whether every simulation behind them came to repeat itself
    """

    areas: np.ndarray
    change: np.ndarray
    mean: float
    slopes: np.ndarray
    periodic: bool = True

    @cached_property
    def _change(self) -> CubicSpline:
        return CubicSpline(np.log(self.areas), self.change)

    @cached_property
    def _slopes(self):
        return make_interp_spline(np.log(self.areas[SLOPE_NODES]), self.slopes, k=1)

    def harmonics(self, area: float) -> np.ndarray:
        """Change (K,) of the flow's peak amplitudes, m3/s, orders 0 to K - 1, for a leak area."""
        return area * self._change(np.log(np.clip(area, self.areas[0], self.areas[-1])))

    def gained(self, area: float) -> float:
        """Change of the mean flow over the healthy pump's, for a leak area; below zero."""
        return self.harmonics(area)[0].real / self.mean

    def pump_slopes(self, area: float) -> np.ndarray:
        """What one standard deviation of each of the pump's numbers makes of it (P, K), m3/s, as
        the port plate stands (`plate_turns`)."""
        first, *_, last = self.areas[SLOPE_NODES]
        return area * self._slopes(np.log(np.clip(area, first, last)))


def simulate_healthy_pump(
    pump: Mapping, fluid: Fluid, speed_rpm: float, pressure: float
) -> PumpRipple:
    """Ripple of the healthy pump at r/min into a pressure, Pa; the last simulations are kept.

    Raises ArithmeticError where the chamber equations cannot be solved.
    """
    return _simulated(_key(pump), fluid, float(speed_rpm), float(pressure))


def simulate_leaking_pump(
    pump: Mapping, fluid: Fluid, speed_rpm: float, pressure: float, fault: Fault, area: float
) -> PumpRipple:
    """Ripple of the pump with a fault of this leak area, m2, at piston 0.

    Raises ArithmeticError where the chamber equations cannot be solved.
    """
    numbers = stated_numbers(pump)
    leaks = list(fault.leaks(float(area), 0, numbers["pistons"]))
    outlet = ConstantPressure(float(pressure))
    return simulate(numbers, fluid, float(speed_rpm), outlet, leaks, min_steps=STEPS)


def leak_velocity(pump: Mapping, fluid: Fluid, pressure: float) -> float:
    """Flow of a leak over its area, m/s, under a pressure, Pa: that of a sharp-edged orifice."""
    discharge = Geometry.from_dict(dict(pump)).leak_discharge
    return discharge * np.sqrt(2.0 * pressure / fluid.density)


def simulate_leak_flow(
    pump: Mapping, fluid: Fluid, speed_rpm: float, pressure: float, fault: Fault
) -> LeakFlow:
    """`LeakFlow` of a fault at r/min into a pressure, Pa; the last ones are kept.

    Raises ArithmeticError where the chamber equations cannot be solved.
    """
    return _leak_flow(_key(pump), fluid, float(speed_rpm), float(pressure), fault)


@lru_cache(KEPT_FLOWS)
def _leak_flow(
    key: tuple, fluid: Fluid, speed_rpm: float, pressure: float, fault: Fault
) -> LeakFlow:
    pump = dict(key)
    mean = peak_amplitudes(simulate_healthy_pump(pump, fluid, speed_rpm, pressure).flow)[0].real
    one_piston = mean / pump["pistons"] / leak_velocity(pump, fluid, pressure)
    areas = one_piston * np.geomspace(fault.smallest, fault.largest, NODES)

    periodic: list[bool] = []

    def change(numbers: Mapping, at: np.ndarray) -> np.ndarray:
        point = numbers, fluid, speed_rpm, pressure
        runs = [
            simulate_healthy_pump(*point),
            *(simulate_leaking_pump(*point, fault, a) for a in at),
        ]
        periodic.extend(run.converged for run in runs)
        healthy, *leaking = (peak_amplitudes(run.flow) for run in runs)
        return (np.array(leaking) - healthy)[:, : ORDERS + 1] / at[:, None]

    found = change(pump, areas)
    at = areas[SLOPE_NODES]
    turns = plate_turns(np.arange(ORDERS + 1))
    slopes = [
        turn * change(moved, at) - found[SLOPE_NODES]
        for turn, moved in zip(turns, moved_pumps(pump), strict=True)
    ]
    return LeakFlow(areas, found, float(mean), np.stack(slopes, axis=1), all(periodic))


def moved_pumps(pump: Mapping) -> list[dict]:
    """The pump with one of `NUMBERS` after the other moved by a standard deviation."""
    geometry = Geometry.from_dict(dict(pump))
    moved = [{**pump, name: getattr(geometry, name) * (1.0 + sd)} for name, sd in UNCERTAIN.items()]
    timing = geometry.port_timing_deg + TIMING_SD_DEG
    return [*moved, {**pump, "port_timing_deg": timing}]


def plate_turns(orders: np.ndarray) -> np.ndarray:
    """Factors (P, F) that turn the flow of each of `moved_pumps` at shaft orders (F,) to where the
    port plate of the pump stands.

    Another timing turns the flow, healthy and leaking, by as much. That says nothing, since the
    shaft angle of a recording is unknown, but is far from linear at high orders.
    """
    turns = np.ones((len(NUMBERS), len(orders)), complex)
    turns[NUMBERS.index("port_timing_deg")] = np.exp(1j * np.radians(TIMING_SD_DEG) * orders)
    return turns


def _key(pump: Mapping) -> tuple:
    return tuple(sorted(stated_numbers(pump).items()))


@lru_cache(KEPT_RIPPLES)
def _simulated(pump: tuple, fluid: Fluid, speed_rpm: float, pressure: float) -> PumpRipple:
    return simulate(dict(pump), fluid, speed_rpm, ConstantPressure(pressure), min_steps=STEPS)
