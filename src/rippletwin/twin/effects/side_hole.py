"""An open hole in the wall: a short branch that ends in the room, or in a vessel that is large."""

from __future__ import annotations

import numpy as np

from rippletwin.line.frequency_domain.line_network import Insert
from rippletwin.line.frequency_domain.pipe_immittance import series_impedance
from rippletwin.twin.effects.base import (
    Effect,
    on_line,
    position_parameter,
    position_place,
    segment_at,
)
from rippletwin.twin.effects.open_end import FLANGED, radiation_impedance
from rippletwin.twin.parameters import Parameter
from rippletwin.twin.priors import lognormal


def inner_length(radius, bore_radius):
    """Length, m, by which the flow that turns into a hole prolongs it, the matching volume
    included (Dubos et al. 1999); holes up to the bore's radius."""
    d = np.minimum(radius / bore_radius, 1.0)
    turn = 0.82 - d * (0.193 + d * (1.09 - d * (1.27 - d * 0.71)))
    return radius * (turn + 0.125 * d * (1.0 + 0.207 * d**3))


def hole_impedance(s, diameter, height, bore, wave_speed, density, viscosity, friction):
    """p/q of an open hole at the bore's axis, Pa s/m3; SI units, all broadcast with s (F,)."""
    inertance = density / (0.25 * np.pi * diameter**2) * s
    wall = series_impedance(
        s, density=density, viscosity=viscosity, diameter=diameter, friction=friction
    )
    outside = radiation_impedance(s, diameter, wave_speed, density, FLANGED)
    return height * wall + inner_length(0.5 * diameter, 0.5 * bore) * inertance + outside


def _apply(network, state, values, place):
    k = segment_at(network.lengths, values["position"])
    impedance = hole_impedance(
        network.s,
        values["diameter"],
        values["height"],
        state.diameters[k],
        state.wave_speeds[k],
        state.density,
        state.viscosity,
        state.friction,
    )
    network.inserts.append(Insert(on_line(network, values["position"]), "shunt", 1.0 / impedance))


EFFECT = Effect(
    name="side_hole",
    element="position",
    medium="any",
    equation="q1 - q2 = p/Z, Z = h Z' + s rho t_i/(pi b^2) + Z_r, b = d/2; "
    "t_i = b (0.82 - 0.193 D - 1.09 D^2 + 1.27 D^3 - 0.71 D^4 + D (1 + 0.207 D^3)/8), "
    "D = b/R; Z_r that of a flanged open end",
    source="Keefe 1982, J. Acoust. Soc. Am. 72:676 (short open hole); Dubos et al. 1999, "
    "Acta Acustica 85:153 (t_i)",
    parameters=lambda rig, place: (
        position_parameter(rig),
        Parameter("diameter", "m", lognormal(0.5 * rig.line[0].diameter, 0.5)),
        Parameter("height", "m", lognormal(0.3 * rig.line[0].diameter, 0.7)),
    ),
    places=position_place,
    apply=_apply,
)
