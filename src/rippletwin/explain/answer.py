"""The pump answers the ripple it makes.

The lumped pump as a source is its flow into a constant pressure and the mean admittance of its
chambers beside it (`rippletwin.pump.source`). But ports open and close as the shaft turns, and the
flow through one that is nearly shut goes with the root of the pressure drop: what the line's own
ripple does to the flow is partly at other harmonics and no proportion of it. On the default pump in
a 5 m pipe that is 5 % of the ripple (docs/pump.md). Once an explanation tells the pressure at the
outlet, the pump is simulated against it (waveform relaxation; Lelarasmee, Ruehli &
Sangiovanni-Vincentelli 1982, IEEE Trans. CAD 1, 131), and the source is the flow that with the
same admittance beside it gives what this pump delivers there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rippletwin.forward import Forward
from rippletwin.twin import Twin


def answered(twin: Twin, observations: Sequence) -> list | None:
    """The observations with the ripple of a pump that works against the outlet pressure that `twin`
    predicts; None where no source is the lumped pump's, so that nothing changes."""
    found = [_answered(twin, o) for o in observations]
    return found if any(new is not old for new, old in zip(found, observations)) else None


def _answered(twin: Twin, observation):
    """The observation, with its ripple as `flow_ripple` where that is the lumped pump's."""
    given = observation.kind != "periodic" or observation.source != "nominal"
    if given or observation.flow_ripple is not None:
        return observation
    from rippletwin.pump import PressureWave, simulate

    ripple = twin.operating_point(observation).ripple
    forward = Forward(twin, [observation])
    orders = np.asarray(observation.orders, int)
    turn = forward.turn(twin.theta)
    outlet = forward.network(twin.theta).pressure_at([0.0])[0] / turn
    count = len(ripple.flow)

    def wave(harmonics):
        spectrum = np.zeros(count // 2 + 1, complex)
        spectrum[orders] = 0.5 * count * harmonics
        return np.fft.irfft(spectrum, count)

    pressure = PressureWave(observation.load_pressure + wave(outlet))
    rig, speed_rpm = twin.rig, 60.0 * observation.speed_hz
    delivered = simulate(rig.pump, rig.fluid, speed_rpm, pressure, samples_per_revolution=count)
    taken = wave(ripple.source_admittance(forward.s) * outlet)
    return replace(observation, flow_ripple=replace(ripple, flow=delivered.flow + taken))
