"""What a leak changes in the flow of the pump, at every shaft order and for every leak area.

The lumped pump is simulated at a few leak areas. The change of flow over the area is smooth in the
logarithm of the area, so that a spline through these gives all others. The pump delivers into a
constant pressure: against the ripple of its line the change differs by less than 1 %, far below
what a leak's own law is uncertain by.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np
from scipy.interpolate import CubicSpline

from rippletwin.case.model import Fluid
from rippletwin.diagnosis.faults.base import Fault
from rippletwin.harmonics import peak_amplitudes
from rippletwin.pump.geometry import Geometry
from rippletwin.pump.outlets import ConstantPressure
from rippletwin.pump.simulation import PumpRipple, simulate
from rippletwin.twin.operating_point import OperatingCondition
from rippletwin.twin.twin import Twin

STEPS = 3072  # a revolution: the change moves by 0.3 % when they are doubled, 1 % at 1e-8 m2
NODES = 15  # leak areas that are simulated, a factor of 1.6 apart
ORDERS = 600  # highest shaft order whose flow is kept
LEAK_DISCHARGE = 0.7  # discharge coefficient of a leak where the data sheet gives none
FITTED = ("bulk_modulus", "port_timing")  # the twin's names of the pump's fitted numbers


def with_fitted_pump(twin: Twin, mean_flow: float | None = None, speed_hz: float = 1.0) -> Twin:
    """The twin with its pump's numbers as fitted, and none of them a parameter.

    Where the data sheet gives the number of pistons alone, the default pump is scaled to deliver
    `mean_flow`, m3/s, at `speed_hz`, rev/s.
    """
    pump = {key: value for key, value in twin.rig.pump.items() if value is not None}
    if set(pump) == {"pistons"} and mean_flow is not None:
        pump = _scaled(Geometry.from_dict(pump), mean_flow / speed_hz)
    kept = np.ones(len(twin.theta), bool)
    if twin.uncertain_pump:
        values = twin.values()
        pump["bulk_modulus"], pump["port_timing_deg"] = (values[name] for name in FITTED)
        kept[[twin.index[name] for name in FITTED]] = False
    return Twin(
        replace(twin.rig, pump=pump),
        [OperatingCondition(label=label) for label in twin.labels],
        friction=twin.friction,
        effects=twin.effects,
        source_sd=twin.source_sd,
        theta=twin.theta[kept],
        guessed_load=twin.guessed_load,
    )


def _scaled(pump: Geometry, displacement: float) -> dict:
    """The pump, all its lengths changed alike, of another displacement, m3 a revolution."""
    ratio = displacement / pump.displacement
    return {
        "pistons": pump.pistons,
        "piston_diameter": pump.piston_diameter * ratio ** (1 / 3),
        "pitch_radius": pump.pitch_radius * ratio ** (1 / 3),
        "dead_volume": pump.dead_volume * ratio,
        "port_area": pump.port_area * ratio,
    }


@dataclass(frozen=True)
class LeakFlow:
    """The change of a pump's flow with the area of a leak at piston 0.

    areas    (A,) simulated, m2, ascending
    change   (A, K) change over area of the flow's peak amplitudes at orders 0 to K - 1, m/s
    mean     mean flow of the healthy pump, m3/s
    """

    areas: np.ndarray
    change: np.ndarray
    mean: float

    @cached_property
    def _spline(self) -> CubicSpline:
        return CubicSpline(np.log(self.areas), self.change)

    def harmonics(self, area: float) -> np.ndarray:
        """Change (K,) of the flow's peak amplitudes, m3/s, orders 0 to K - 1, for a leak area."""
        return area * self._spline(np.log(np.clip(area, self.areas[0], self.areas[-1])))


def healthy_flow(pump: Mapping, fluid: Fluid, speed_rpm: float, pressure: float) -> PumpRipple:
    """Ripple of the healthy pump at r/min into a pressure, Pa; simulations are kept."""
    return _simulated(_key(pump), fluid, float(speed_rpm), float(pressure), None, 0.0)


def leak_flow(
    pump: Mapping, fluid: Fluid, speed_rpm: float, pressure: float, fault: Fault
) -> LeakFlow:
    """`LeakFlow` of a fault at r/min into a pressure, Pa; simulations are kept."""
    healthy = peak_amplitudes(healthy_flow(pump, fluid, speed_rpm, pressure).flow)
    areas = np.geomspace(fault.smallest, fault.largest, NODES)
    change = [
        peak_amplitudes(
            _simulated(
                _key(pump), fluid, float(speed_rpm), float(pressure), fault, float(area)
            ).flow
        )
        - healthy
        for area in areas
    ]
    change = np.array(change)[:, : ORDERS + 1] / areas[:, None]
    return LeakFlow(areas, change, float(healthy[0].real))


def _key(pump: Mapping) -> tuple:
    return tuple(sorted((k, v) for k, v in pump.items() if v is not None))


@cache
def _simulated(
    pump: tuple, fluid: Fluid, speed_rpm: float, pressure: float, fault: Fault | None, area: float
) -> PumpRipple:
    numbers, leaks = dict(pump), None
    if fault is not None:
        if "discharge_coefficient" not in numbers:
            area *= LEAK_DISCHARGE / Geometry.discharge_coefficient
        leaks = list(fault.leaks(area, 0, numbers["pistons"]))
    outlet = ConstantPressure(pressure)
    return simulate(numbers, fluid, speed_rpm, outlet, leaks, min_steps=STEPS)
