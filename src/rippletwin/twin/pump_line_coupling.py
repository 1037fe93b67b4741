"""Source-line coupling: the lumped pump simulated against the outlet pressure of a twin.

As a source the lumped pump is its flow into a constant pressure and, parallel to it, the mean
admittance of its chambers (`source_admittance`). That is an approximation: ports open and close as
the shaft turns, and the flow through a nearly shut port goes with the root of the pressure drop, so
that the outlet ripple changes the flow at other harmonics too, and not in proportion. Where numbers
of the pump are fitted, the flow is besides a sum of parabolas in them (`ripple_sensitivity`), which
leaves out what two numbers do together.

Where a twin predicts the pressure at the outlet, the pump with the fitted numbers is simulated
against it: one step of waveform relaxation (Lelarasmee, Ruehli & Sangiovanni-Vincentelli 1982, IEEE
Trans. CAD 1, 131). The new source is the flow that with the same admittance and parabolas delivers
what the pump delivers there. Steps may follow each other, each with a fit of the last source.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rippletwin.harmonics import flow_harmonics, one_period
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.operating_point import pressure_fall
from rippletwin.twin.twin import Twin

BAND = 2.0  # simulated over observed: the turning ports couple a harmonic to those above it


def couple_pump_to_line(twin: Twin, observations: Sequence) -> list | None:
    """The observations with the flow ripple of the lumped pump against the outlet pressure that
    `twin` predicts; None where no source is the lumped pump's, so that nothing changes.

    observations   with the ripple that the twin was fitted with: that of the lumped pump into a
                   constant pressure, or one of this function
    """
    coupled = [_couple(twin, o) for o in observations]
    return coupled if any(new is not old for new, old in zip(coupled, observations)) else None


def _couple(twin: Twin, observation):
    """The observation with the coupled ripple as `flow_ripple`, or itself where its ripple is not
    the lumped pump's."""
    from rippletwin.pump.outlets import PressureWave
    from rippletwin.pump.simulation import PumpRipple, simulate

    given = observation.flow_ripple
    if observation.kind != "periodic" or observation.source != "nominal":
        return observation
    if given is not None and not (isinstance(given, PumpRipple) and given.orifice is None):
        return observation
    ripple = twin.operating_point(replace(observation, modulation=0.0)).ripple
    even = _wide(observation, ripple.highest_order)
    forward = ForwardModel(twin, [even])
    orders, count = even.orders, len(ripple.flow)
    pump, turned = _pump(twin)
    # In the frame of the port plate, which the twin turns with the shaft (`ripple_sensitivity`).
    plate = np.exp(1j * orders * turned)
    turn = forward.source.turn(twin.theta) * plate
    outlet = forward.network(twin.theta).pump_pressure() / turn
    point = twin.operating_point(even)
    mean = point.load_pressure + pressure_fall(twin.calibrated_rig(), 0.0, point.mean_flow)
    wave = PressureWave(mean + one_period(outlet, count, orders))
    run = simulate(pump, twin.rig.fluid, 60.0 * even.speed_hz, wave, samples_per_revolution=count)
    source = flow_harmonics(run, orders) + run.source_admittance(forward.s) * outlet
    flow = np.mean(ripple.flow) + one_period(source * plate, count, orders)
    return replace(observation, flow_ripple=replace(run, flow=flow))


def _wide(observation, resolved: int):
    """The observation with harmonics above those observed, up to BAND times the highest, but none
    above the order `resolved` of the ripple, and without modulation: the twin modulates the ripple
    that is found."""
    orders = np.asarray(observation.orders, int)
    step = np.gcd.reduce(orders)
    orders = np.append(orders, np.arange(orders[-1] + step, int(BAND * orders[-1]), step))
    orders = orders[orders <= resolved]
    return replace(
        observation, orders=orders, frequency_hz=orders * observation.speed_hz, modulation=0.0
    )


def _pump(twin: Twin) -> tuple[dict, float]:
    """The pump's numbers as fitted, and the angle of its port plate from the data sheet's, rad."""
    pump = twin.fitted_pump()
    if not twin.uncertain_pump:
        return pump, 0.0
    timing = twin.parameters[twin.index["port_timing"]]
    return pump, float(np.radians(pump["port_timing_deg"] - timing.nominal))
