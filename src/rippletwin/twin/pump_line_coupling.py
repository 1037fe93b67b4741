"""The pump answers the ripple it makes.

The lumped pump as a source is its flow into a constant pressure and the mean admittance of its
chambers beside it (`source_admittance`). But ports open and close as the shaft turns, and the
flow through one that is nearly shut goes with the root of the pressure drop: what the line's own
ripple does to the flow is partly at other harmonics and no proportion of it. On the default pump in
a 5 m pipe that is 5 % of the ripple (docs/explanation/pump.md). Once an explanation tells the
pressure at the outlet, the pump is simulated against it (waveform relaxation; Lelarasmee, Ruehli &
Sangiovanni-Vincentelli 1982, IEEE Trans. CAD 1, 131), and the source is the flow that with the
same admittance beside it gives what this pump delivers there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rippletwin.harmonics import flow_harmonics, one_period
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.twin import Twin


def couple_pump_to_line(twin: Twin, observations: Sequence) -> list | None:
    """The observations with the ripple of a pump that works against the outlet pressure that `twin`
    predicts; None where no source is the lumped pump's, so that nothing changes."""
    found = [_answered(twin, o) for o in observations]
    return found if any(new is not old for new, old in zip(found, observations)) else None


def _answered(twin: Twin, observation):
    """The observation, with its ripple as `flow_ripple` where that is the lumped pump's."""
    given = observation.kind != "periodic" or observation.source != "nominal"
    if given or observation.flow_ripple is not None:
        return observation
    from rippletwin.pump.outlets import ConstantPressure, PressureWave
    from rippletwin.pump.simulation import simulate

    ripple = twin.operating_point(observation).ripple
    forward = ForwardModel(twin, [observation])
    orders = np.asarray(observation.orders, int)
    pump, turned = _pump(twin)
    # In the frame of the port plate, which the twin turns with the shaft (`pump.uncertain`).
    turn = forward.source.turn(twin.theta) * np.exp(1j * orders * turned)
    outlet = forward.network(twin.theta).pressure_at([0.0])[0] / turn
    count, mean = len(ripple.flow), observation.load_pressure

    def harmonics(outlet):
        speed_rpm = 60.0 * observation.speed_hz
        run = simulate(pump, twin.rig.fluid, speed_rpm, outlet, samples_per_revolution=count)
        return flow_harmonics(run, orders), run

    free, source = harmonics(ConstantPressure(mean))
    delivered, _ = harmonics(PressureWave(mean + one_period(outlet, count, orders)))
    answer = delivered - free + source.source_admittance(forward.s) * outlet
    answer = answer * np.exp(1j * orders * turned)
    flow = ripple.flow + one_period(answer, count, orders)
    return replace(observation, flow_ripple=replace(ripple, flow=flow))


def _pump(twin: Twin) -> tuple[dict, float]:
    """The pump with its numbers as fitted, and the angle, rad, by which its port plate is off."""
    values, pump = twin.values(), dict(twin.rig.pump)
    if not twin.uncertain_pump:
        return pump, 0.0
    sheet = twin.parameters[twin.index["port_timing"]].nominal
    pump |= {"bulk_modulus": values["bulk_modulus"], "port_timing_deg": values["port_timing"]}
    return pump, float(np.radians(values["port_timing"] - sheet))
