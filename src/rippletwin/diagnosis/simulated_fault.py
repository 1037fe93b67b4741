"""What the sensors of a twin's rig would read while its pump has a fault of a known leak area.

The lumped pump delivers into a constant pressure, healthy and faulty. Its flow, with the chambers'
capacitance beside it, drives the twin's line in the time domain. What the twin's corrected ripple
adds to the healthy flow is added to that of the faulty pump too. The faulty pump meets the load
that holds the healthy one at the load pressure, so that a leak lowers the mean pressure too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rippletwin.diagnosis.faults.base import Fault
from rippletwin.diagnosis.faults.library import find_fault
from rippletwin.diagnosis.pump_flow import (
    leak_velocity,
    simulate_healthy_pump,
    simulate_leaking_pump,
    with_fitted_pump,
)
from rippletwin.errors import InputError
from rippletwin.pump.geometry import stated_numbers
from rippletwin.twin.operating_point import OperatingCondition, operating_point
from rippletwin.twin.propagation import propagate
from rippletwin.twin.twin import Twin


@dataclass(frozen=True)
class SimulatedFault:
    """One revolution: time_s (M,), pressure (S, M) in Pa gauge at the twin's sensors.

    It starts with piston 0, that of the fault, at outer dead centre. `area`, m2, is 0 for a healthy
    pump; `mean_flow`, m3/s, is the pump's. `warnings` are in plain words.
    """

    area: float
    time_s: np.ndarray
    pressure: np.ndarray
    mean_flow: float
    warnings: tuple[str, ...] = ()


def simulate_fault(
    twin: Twin,
    fault: Fault | str | None,
    area: float,
    speed_rpm: float,
    load_pressure: float,
) -> SimulatedFault:
    """`SimulatedFault` of a fault with leak area in m2, at r/min.

    fault : itself, or its name or file as in `find_fault`; None for healthy.
    load_pressure : Pa gauge before the load while the pump is healthy.

    Raises InputError where the twin has no pump, where an orifice has no pressure over it, for a
    load given as a measured impedance, and where pump or line find no periodic state.
    """
    fault = find_fault(fault) if isinstance(fault, str) else fault
    warnings: list[str] = []
    # A diagnosis, for which `with_fitted_pump` is, has no use for the corrected ripple.
    twin = _with_pump(twin, speed_rpm / 60.0, load_pressure, warnings).with_(ripple=twin.ripple)
    pump, fluid = twin.rig.pump, twin.rig.fluid
    point = pump, fluid, speed_rpm, load_pressure
    try:
        healthy = simulate_healthy_pump(*point)
        ripple = healthy if fault is None else simulate_leaking_pump(*point, fault, area)
        capacitance = healthy.source_capacitance(pump["pistons"] * speed_rpm / 60.0)
        run = propagate(
            twin, ripple.flow, healthy.flow, speed_rpm / 60.0, load_pressure, capacitance
        )
        if not (run.converged and np.isfinite(run.pressure).all()):
            raise ArithmeticError("the line does not repeat itself from revolution to revolution")
    except ArithmeticError as error:
        raise InputError(
            "command line",
            "operating point",
            str(error),
            "Give a smaller leak, or another speed or pressure",
        ) from None
    if fault is not None:
        one_piston = healthy.flow.mean() / pump["pistons"]
        share = area * leak_velocity(pump, fluid, load_pressure) / one_piston
        if not fault.smallest <= share <= fault.largest:
            warnings.append(
                f"a leak of {1e6 * area:.3g} mm2 passes {share:.3g} times the mean flow of one "
                f"piston; diagnose considers {fault.smallest:g} to {fault.largest:g} times"
            )
    count = len(ripple.flow)
    time_s = np.arange(count) / count * 60.0 / speed_rpm
    mean = float(ripple.flow.mean())
    return SimulatedFault(area, time_s, run.pressure, mean, tuple(warnings))


def _with_pump(twin: Twin, speed_hz: float, load_pressure: float, warnings: list) -> Twin:
    """The twin with its pump as fitted, or the default pump that delivers the mean of the flow
    ripples that recordings stated, or else what its load passes."""
    load, pump = twin.rig.load, twin.rig.pump
    if "pistons" not in pump:
        raise InputError(
            "twin", "pump", "has no pistons", "Give the twin of a rig with a piston pump"
        )
    if load.kind == "orifice" and load_pressure <= load.back_pressure:
        raise InputError(
            "command line",
            "--pressure",
            f"{load_pressure / 1e5:g} bar are not above the back pressure of the orifice, "
            f"{load.back_pressure / 1e5:g} bar",
            "Give the pressure before the load",
        )
    if len(stated_numbers(pump)) > 1:
        return with_fitted_pump(twin)
    displacement, giver = twin.rig.displacement, "flow ripple"
    if displacement is None:
        condition = OperatingCondition(
            speed_hz=speed_hz, load_pressure=load_pressure, source="free"
        )
        mean_flow = operating_point(twin.rig, condition, None).mean_flow
        displacement, giver = mean_flow / speed_hz, "load"
    warnings.append(
        f"only the number of pistons is known of the pump: a default pump of the {giver}'s mean "
        "flow takes its place, and its leak is as uncertain as that"
    )
    if not np.isfinite(displacement):
        raise InputError("twin", "pump", "gives no mean flow", "Give the geometry of the pump")
    return with_fitted_pump(twin, displacement)
