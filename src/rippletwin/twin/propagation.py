"""Time-domain propagation of a pump's flow through a twin's line to its sensors."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from rippletwin.errors import InputError
from rippletwin.harmonics import one_period, peak_amplitudes, resample_period
from rippletwin.line.time_domain import method_of_characteristics
from rippletwin.line.time_domain.line_elements import End, Pipe, TimeDomainLine, capacitance
from rippletwin.twin.effects.base import LineState
from rippletwin.twin.flow_source import pump_changes
from rippletwin.twin.operating_point import guessed_flow
from rippletwin.twin.time_domain_form import apply_in_time, series_elements
from rippletwin.twin.twin import Twin
from rippletwin.twin.unknown_load import unknown_impedance

MAX_PERIODS = 200  # until the line is periodic


def propagate(
    twin: Twin,
    flow: np.ndarray,
    healthy_flow: np.ndarray,
    speed_hz: float,
    load_pressure: float,
    source_capacitance: float = 0.0,
    steps: int = 12288,
    tolerance: float = 1e-6,
) -> method_of_characteristics.Transient:
    """One periodic revolution at the twin's sensors by the method of characteristics.

    Parameters
    ----------
    twin : calibrated, with the effects of its correction.
    flow, healthy_flow : (M,) m3/s at the pump outlet over one revolution, of the pump to simulate
        and of the healthy one. The healthy mean determines the orifice, which a faulty pump meets
        too. Both are the data sheet's pump; `pump_change` is added.
    speed_hz, load_pressure : rev/s, and Pa upstream of the load when the pump is healthy.
    source_capacitance : m3/Pa of the chambers parallel to the flow source, see
        `PumpRipple.source_capacitance`.
    steps : least number of steps a revolution.

    Returns the `Transient` with M samples a revolution. The load factor of the twin scales orifice
    and mean flow alike, so that the load pressure stays that of the recording, as in the frequency
    domain. Raises InputError as `line_in_time`.
    """
    line = line_in_time(twin, flow, healthy_flow, speed_hz, load_pressure, source_capacitance)
    count = method_of_characteristics.steps_a_period(line.pipes, line.period, steps)
    line.flow = resample_period(line.flow, count)
    transient = method_of_characteristics.simulate(line, periods=MAX_PERIODS, tolerance=tolerance)
    return replace(
        transient,
        pressure=resample_period(transient.pressure, len(flow)),
        flow=resample_period(transient.flow, len(flow)),
    )


def line_in_time(
    twin: Twin, flow, healthy_flow, speed_hz, load_pressure, source_capacitance=0.0
) -> TimeDomainLine:
    """The twin as a `TimeDomainLine`, every effect in it; arguments as `propagate`'s.

    Raises InputError for a load that has no time domain, for a mean flow into a closed end, and for
    an effect that no passive rational function follows.
    """
    rig = twin.calibrated_rig()
    if rig.load.kind == "impedance":
        raise InputError(
            "rig.yaml", "load.kind", "a measured impedance has no time domain", "Give an orifice"
        )
    if rig.load.kind == "closed" and np.mean(healthy_flow) != 0.0:
        raise InputError(
            "rig.yaml",
            "load.kind",
            "the mean flow of a pump has no way out of a closed end",
            "Give an orifice",
        )
    change, more = pump_change(twin, healthy_flow, speed_hz, load_pressure)
    if source_capacitance:  # a given ripple is an ideal source
        source_capacitance += more
    factor = twin.values().get("load", 1.0)
    mean = nominal = float(np.mean(healthy_flow))
    coefficient, resistance = 0.0, None
    unknown = rig.load.kind == "unknown"
    if rig.load.kind == "orifice":
        root = np.sqrt(load_pressure - rig.load.back_pressure)
        known = guessed_flow(rig) if twin.guessed_load else mean
        coefficient = rig.load.coefficient or factor * known / root
        mean, resistance = coefficient * root, 2.0 * root / coefficient
        nominal = mean / factor
    pressure = rig.load.back_pressure if rig.load.kind == "orifice" else load_pressure
    line = TimeDomainLine(
        pipes=[Pipe(s.length, s.diameter, s.wave_speed) for s in rig.line],
        flow=np.asarray(flow, dtype=float) + change - np.mean(healthy_flow) + mean,
        period=1.0 / speed_hz,
        end=End("open" if unknown else rig.load.kind, pressure, coefficient),
        density=rig.fluid.density,
        viscosity=rig.fluid.kinematic_viscosity,
        friction=twin.friction,
        positions=[sensor.position for sensor in rig.sensors],
        mean_flow=mean,
        source=[capacitance(0.0, source_capacitance)] if source_capacitance else [],
    )
    v = twin.arrays(twin.theta)
    if unknown:
        impedance = partial(unknown_impedance, v=v, density=line.density)
        line.load += series_elements("the unknown load", impedance, line.period)
    line.sensors += [(k, partial(_gain, g)) for k, g in enumerate(np.ravel(v.gains)) if g != 1.0]
    state = LineState(
        density=line.density,
        viscosity=line.viscosity,
        diameters=np.array([s.diameter for s in rig.line]),
        wave_speeds=np.array([s.wave_speed for s in rig.line]),
        lengths=np.array([s.length for s in rig.line]),
        mean_pressure=load_pressure,
        load_resistance=resistance,
        heat_capacity_ratio=rig.fluid.heat_capacity_ratio,
        prandtl=rig.fluid.prandtl,
        mean_flow=np.array(nominal),
        load_passes_flow=rig.load.passes_flow and not twin.guessed_load,
        friction=twin.friction_law,
        effects=twin.effects,
    )
    for effect, place, values in twin.applied_effects(twin.theta):
        apply_in_time(effect, line, state, values, place)
    return line


def _gain(gain: complex, s: np.ndarray) -> np.ndarray:
    """What an uncalibrated sensor reads over the pressure, at s (F,); real at rest."""
    return np.where(s == 0.0, np.abs(gain), gain)


def pump_change(twin: Twin, healthy_flow, speed_hz: float, load_pressure: float):
    """Flow (M,), m3/s, and capacitance, m3/Pa, that the twin's parameters of the pump and its
    corrected ripple add to the data sheet's, for a healthy and for a faulty pump alike."""
    count, mean = len(healthy_flow), float(np.mean(healthy_flow))
    flow, capacity = np.zeros(count), 0.0
    pumping = np.array([2j * np.pi * speed_hz * twin.rig.pump.get("pistons", 1)])
    orders = np.arange(1, (count - 1) // 2 + 1)
    for k, change in pump_changes(twin, speed_hz, load_pressure):
        u = twin.theta[k]
        spectrum = np.array([1.0, u, u**2]) @ change.harmonics(orders, mean)
        flow += one_period(spectrum, count, orders)
        capacity += u * float(change.source_admittance(pumping)[0].imag / pumping[0].imag)
    if twin.ripple is not None:
        pistons = twin.rig.pump.get("pistons", 1)
        even = orders[orders % pistons == 0]  # equal pistons make no other orders
        spectrum = np.zeros(len(orders), complex)
        spectrum[even - 1] = (twin.ripple.at("", even) - 1.0) * peak_amplitudes(
            healthy_flow + flow
        )[even]
        flow = flow + one_period(spectrum, count, orders)
    return flow, capacity
