"""An end that is meant to be anechoic and reflects a little: most at low frequencies."""

from __future__ import annotations

import numpy as np

from rippletwin.line.frequency_domain.passive_end import end_impedance
from rippletwin.twin.effects.base import Effect, load_place
from rippletwin.twin.parameters import Parameter
from rippletwin.twin.priors import bounded, lognormal


def _apply(network, state, values, place):
    corner = 2.0 * np.pi * values["corner_frequency"]
    delay = 2.0 * values["depth"] / state.wave_speeds[-1]
    reflected = values["reflection"] * np.exp(-network.s * delay) / (1.0 + network.s / corner)
    characteristic = state.density * state.wave_speeds[-1] / state.area(-1)
    network.load = "impedance", end_impedance(reflected, characteristic)


EFFECT = Effect(
    name="end_reflection",
    element="load",
    medium="any",
    equation="R = r exp(-2 s d/a)/(1 + s/w0), Z_load = Zc (1 + R)/(1 - R)",
    source="Cox & D'Antonio 2016, Acoustic Absorbers and Diffusers, sec. 6.2 (a porous absorber "
    "takes up what is short against its depth; first order)",
    parameters=lambda rig, place: (
        Parameter("reflection", "1", bounded(0.5), (-0.7, 0.7)),
        Parameter("corner_frequency", "Hz", lognormal(500.0, 1.0)),
        Parameter("depth", "m", lognormal(rig.line[-1].diameter, 1.0)),
    ),
    places=lambda rig: load_place(rig) if rig.load.kind == "anechoic" else (),
    apply=_apply,
)
