"""Radiation of an open end, which lengthens the tube a little and loses sound (`open_end`)."""

from __future__ import annotations

from rippletwin.line.time_domain.line_elements import Element
from rippletwin.twin.effects.base import Effect, load_place
from rippletwin.twin.effects.open_end import radiation_impedance, reflection_loss
from rippletwin.twin.parameters import Parameter
from rippletwin.twin.priors import normal


def radiation_element(state, end_correction) -> Element:
    """Z_r = Zc l u/(1 + c u + (c^2 + l^2/3) u^2), u = s r/a, l = `end_correction`, c = b/(2 l).

    The rational function of second order that has the first three terms of `radiation_impedance`
    in u = 0, l u - b u^2/2 - (l u)^3/3; Re Z_r = Zc b (k r)^2/2 over a square: passive.
    """
    delay = 0.5 * state.diameters[-1] / state.wave_speeds[-1]
    characteristic = state.density * state.wave_speeds[-1] / state.area(-1)
    bend = 0.5 * reflection_loss(end_correction) / end_correction
    return Element(
        0.0,
        "series",
        (characteristic * end_correction * delay, 0.0),
        ((bend**2 + end_correction**2 / 3.0) * delay**2, bend * delay, 1.0),
    )


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


EFFECT = Effect(
    name="end_radiation",
    element="load",
    medium="gas",
    equation="Z_load = Zc (1 + R)/(1 - R), R = -exp(-2 s delta/a)/(1 + b (k r)^2); "
    "delta = 0.6133 r, b = 1/2 unflanged; delta = 0.8217 r, b = 1 flanged; between in proportion; "
    "r the radius",
    source="Levine & Schwinger 1948, Phys. Rev. 73:383 (unflanged); Rayleigh 1896, The Theory of "
    "Sound, sec. 302, and Norris & Sheng 1989, J. Sound Vib. 135:85 (flanged)",
    parameters=lambda rig, place: (Parameter("end_correction", "1", normal(0.7, 0.1)),),
    places=lambda rig: load_place(rig) if rig.load.kind == "open" else (),
    apply=_apply,
    apply_in_time=_apply_in_time,
    certain=lambda rig, place: True,
)
