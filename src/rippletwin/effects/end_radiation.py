"""An open end radiates: it is a little longer than the tube, and a little lossy."""

from __future__ import annotations

import numpy as np

from rippletwin.effects.base import Effect, Parameter, load_place, normal


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


def _apply(network, line, values, place):
    network.load = (
        "impedance",
        radiation_impedance(
            network.s,
            line.diameters[-1],
            line.wave_speeds[-1],
            line.density,
            values["end_correction"],
        ),
    )


EFFECT = Effect(
    name="end_radiation",
    element="load",
    medium="gas",
    equation="Z_load = Zc (1 + R)/(1 - R), R = -exp(-2 s delta/a)/(1 + (kR)^2/2); "
    "delta = 0.613 R unflanged, 0.822 R flanged",
    source="Levine & Schwinger 1948, Phys. Rev. 73:383; Norris & Sheng 1989, "
    "J. Sound Vib. 135:85 (flanged)",
    time_domain="the last pipe lengthened by delta, and a first-order loss at its end",
    parameters=lambda rig, place: (Parameter("end_correction", "1", normal(0.7, 0.1)),),
    places=lambda rig: load_place(rig) if rig.load.kind == "open" else (),
    apply=_apply,
    certain=True,
)
