"""A shaft of fluctuating speed: sidebands one shaft order from every piston order."""

from __future__ import annotations

import numpy as np

from rippletwin.harmonics import peak_amplitudes, phase_modulate
from rippletwin.twin.effects.base import Effect, source_place
from rippletwin.twin.parameters import Parameter
from rippletwin.twin.priors import normal


def _apply(network, state, values, place):
    b = complex(values["cosine"], values["sine"])
    flow = np.array(np.broadcast_to(network.source_flow, np.shape(network.s)), dtype=complex)
    for r in np.unique(state.recording):
        own = state.recording == r
        orders = np.asarray(state.orders[own], int)
        spectrum = np.zeros(orders.max() + 1, complex)
        spectrum[0], spectrum[orders] = state.mean_flow[own][0], flow[own]
        flow[own] = peak_amplitudes(phase_modulate(spectrum, b, 4 * len(spectrum)))[orders]
    network.source_flow = flow


def _apply_in_time(line, state, values, place):
    spectrum = peak_amplitudes(line.flow)
    line.flow = phase_modulate(spectrum, complex(values["cosine"], values["sine"]), len(line.flow))


EFFECT = Effect(
    name="speed_fluctuation",
    element="source",
    medium="any",
    equation="q(angle) d angle/dt, angle = t + Re(b e^(j t))",
    source="Randall 2011, Vibration-based Condition Monitoring, sec. 3.3 (phase modulation)",
    parameters=lambda rig, place: (
        Parameter("cosine", "rad", normal(0.0, 5e-3)),
        Parameter("sine", "rad", normal(0.0, 5e-3)),
    ),
    places=source_place,
    apply=_apply,
    apply_in_time=_apply_in_time,
)
