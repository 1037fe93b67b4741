"""From the flow of a pump to the pressure at the sensors, through a calibrated line in time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.signal import resample

from rippletwin.errors import InputError
from rippletwin.line import moc

PERIODS = 200  # at most, until the line repeats itself


def propagate(
    twin,
    flow: np.ndarray,
    healthy_flow: np.ndarray,
    speed_hz: float,
    load_pressure: float,
    source_capacitance: float = 0.0,
    steps: int = 12288,
    tolerance: float = 1e-6,
) -> moc.Transient:
    """One periodic revolution at the twin's sensors by the method of characteristics.

    Parameters
    ----------
    twin : calibrated, without effects beyond its friction law.
    flow, healthy_flow : (M,) m3/s at the pump outlet over one revolution, of the pump to simulate
        and of the healthy one, whose mean settles the orifice that a faulty pump also meets.
    speed_hz, load_pressure : rev/s, and Pa upstream of the load when the pump is healthy.
    source_capacitance : m3/Pa of the chambers beside an ideal source, see `pump.source`.
    steps : at least so many a revolution.

    Returns the `Transient` with M samples a revolution. The load factor of the twin scales orifice
    and mean flow alike, so that the load pressure stays that of the recording, as in the frequency
    domain. Raises InputError for a load given as a measured impedance, ValueError for effects.
    """
    if twin.effects:
        raise ValueError("effects beyond friction have to be propagated in the frequency domain")
    rig = twin.calibrated_rig()
    if rig.load.kind == "impedance":
        raise InputError(
            "rig.yaml", "load.kind", "a measured impedance has no time domain", "Give an orifice"
        )
    factor = twin.values().get("load", 1.0)
    mean = float(np.mean(healthy_flow))
    coefficient = 0.0
    if rig.load.kind == "orifice":
        root = np.sqrt(load_pressure - rig.load.back_pressure)
        coefficient = rig.load.coefficient or factor * mean / root
        mean = coefficient * root
    pressure = rig.load.back_pressure if rig.load.kind == "orifice" else load_pressure
    pipes = [moc.Pipe(s.length, s.diameter, s.wave_speed) for s in rig.line]
    period = 1.0 / speed_hz
    count = moc.steps_a_period(pipes, period, steps)
    driven = resample(flow - np.mean(healthy_flow) + mean, count)
    transient = moc.simulate(
        pipes,
        driven,
        period,
        moc.End(rig.load.kind, pressure, coefficient),
        density=rig.fluid.density,
        viscosity=rig.fluid.kinematic_viscosity,
        friction=twin.friction,
        positions=[sensor.position for sensor in rig.sensors],
        shunts=[moc.Shunt(0.0, capacitance=source_capacitance)] if source_capacitance else [],
        periods=PERIODS,
        tolerance=tolerance,
    )
    return replace(
        transient,
        pressure=resample(transient.pressure, len(flow), axis=1),
        flow=resample(transient.flow, len(flow), axis=1),
    )
