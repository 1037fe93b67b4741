"""An open end radiates: it is a little longer than the tube, and a little lossy."""

from __future__ import annotations

import numpy as np

from rippletwin.line.time_domain.line_elements import Element
from rippletwin.twin.effects.base import Effect, load_place
from rippletwin.twin.parameters import Parameter
from rippletwin.twin.priors import normal


def radiation_impedance(s, diameter, wave_speed, density, end_correction):
    """Z_r = Zc tanh(s delta/a + (s R/2a)^2-loss), Pa s/m3, of an unflanged or flanged end.

    The reflection is -|R0| exp(-2 s delta/a), |R0| = 1/(1 + (kR)^2/2) to second order in kR
    (Levine & Schwinger 1948), delta = `end_correction` radii, so that |R0| <= 1: passive.
    """
    radius = 0.5 * diameter
    k2 = np.abs(s * radius / wave_speed) ** 2
    reflection = -np.exp(-2.0 * s * end_correction * radius / wave_speed) / (1.0 + 0.5 * k2)
    characteristic = density * wave_speed / (np.pi * radius**2)
    return characteristic * (1.0 + reflection) / (1.0 - reflection)


def _apply(network, state, values, place):
    network.load = (
        "impedance",
        radiation_impedance(
            network.s,
            state.diameters[-1],
            state.wave_speeds[-1],
            state.density,
            values["end_correction"],
        ),
    )


def _apply_in_time(line, state, values, place):
    line.load.append(radiation_element(state, values["end_correction"]))


def radiation_element(state, end_correction) -> Element:
    """Z_r = Zc l u/(1 + u/(4 l) + (1/(16 l^2) + l^2/3) u^2), u = s R/a, l = `end_correction`.

    The rational function of second order that has the first three terms of `radiation_impedance`
    in u = 0, l u - u^2/4 - (l u)^3/3; Re Z_r = Zc (kR)^2/4 over a square: passive.
    """
    delay = 0.5 * state.diameters[-1] / state.wave_speeds[-1]
    characteristic = state.density * state.wave_speeds[-1] / state.area(-1)
    bend = 1.0 / (16.0 * end_correction**2) + end_correction**2 / 3.0
    return Element(
        0.0,
        "series",
        (characteristic * end_correction * delay, 0.0),
        (bend * delay**2, delay / (4.0 * end_correction), 1.0),
    )


EFFECT = Effect(
    name="end_radiation",
    element="load",
    medium="gas",
    equation="Z_load = Zc (1 + R)/(1 - R), R = -exp(-2 s delta/a)/(1 + (kR)^2/2); "
    "delta = 0.613 R unflanged, 0.822 R flanged",
    source="Levine & Schwinger 1948, Phys. Rev. 73:383; Norris & Sheng 1989, "
    "J. Sound Vib. 135:85 (flanged)",
    parameters=lambda rig, place: (Parameter("end_correction", "1", normal(0.7, 0.1)),),
    places=lambda rig: load_place(rig) if rig.load.kind == "open" else (),
    apply=_apply,
    apply_in_time=_apply_in_time,
    certain=True,
)
