"""Source-line coupling: the lumped pump simulated against the outlet pressure of a twin.

As a source the lumped pump is its flow into a constant pressure and, parallel to it, the mean
admittance of its chambers (`source_admittance`). That is an approximation: ports open and close as
the shaft turns, and the flow through a nearly shut port goes with the root of the pressure drop, so
that the outlet ripple changes the flow at other harmonics too, and not in proportion. Where a twin
predicts the pressure at the outlet, the pump is simulated against it: one step of waveform
relaxation (Lelarasmee, Ruehli & Sangiovanni-Vincentelli 1982, IEEE Trans. CAD 1, 131). The new
source is the flow that with the same admittance delivers what the pump delivers there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rippletwin.harmonics import flow_harmonics, one_period
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.twin import Twin


def couple_pump_to_line(twin: Twin, observations: Sequence) -> list | None:
    """The observations with the flow ripple of the lumped pump against the outlet pressure that
    `twin` predicts; None where no source is the lumped pump's, so that nothing changes."""
    coupled = [_couple(twin, o) for o in observations]
    return coupled if any(new is not old for new, old in zip(coupled, observations)) else None


def _couple(twin: Twin, observation):
    """The observation with the coupled ripple, modulated, as `flow_ripple`, or itself where its
    ripple is not the lumped pump's."""
    given = observation.kind != "periodic" or observation.source != "nominal"
    if given or observation.flow_ripple is not None:
        return observation
    from rippletwin.pump.outlets import ConstantPressure, PressureWave
    from rippletwin.pump.simulation import simulate

    ripple = twin.operating_point(observation).ripple
    forward = ForwardModel(twin, [observation])
    orders = np.asarray(observation.orders, int)
    pump, turned = _pump(twin)
    # In the frame of the port plate, which the twin turns with the shaft (`ripple_sensitivity`).
    turn = forward.source.turn(twin.theta) * np.exp(1j * orders * turned)
    outlet = forward.network(twin.theta).pressure_at([0.0])[0] / turn
    count, mean = len(ripple.flow), observation.load_pressure

    def deliver(outlet):
        speed_rpm = 60.0 * observation.speed_hz
        run = simulate(pump, twin.rig.fluid, speed_rpm, outlet, samples_per_revolution=count)
        return flow_harmonics(run, orders), run

    free, source = deliver(ConstantPressure(mean))
    delivered, _ = deliver(PressureWave(mean + one_period(outlet, count, orders)))
    response = delivered - free + source.source_admittance(forward.s) * outlet
    response = response * np.exp(1j * orders * turned)
    flow = ripple.flow + one_period(response, count, orders)
    return replace(observation, flow_ripple=replace(ripple, flow=flow), modulation=0.0)


def _pump(twin: Twin) -> tuple[dict, float]:
    """The pump's numbers as fitted, and the angle of its port plate from the data sheet's, rad."""
    pump = twin.fitted_pump()
    if not twin.uncertain_pump:
        return pump, 0.0
    timing = twin.parameters[twin.index["port_timing"]]
    return pump, float(np.radians(pump["port_timing_deg"] - timing.nominal))
