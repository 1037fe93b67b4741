"""A viscoelastic wall: creep adds compliance at low frequency and loss around 1/tau.

One segment is a hose, or all segments creep alike. Every wall, clamp and seal creeps a little: in a
metal pipe a tenth of what a hose does. Each segment alone shows too little of that, and a twin
without it makes up for it by lengths and diameters. A hose is no metal pipe: the creep of all walls
leaves it out.
"""

from __future__ import annotations

from dataclasses import replace

from rippletwin.twin.effects.base import Effect, line_place, segment_places
from rippletwin.twin.parameters import Parameter
from rippletwin.twin.priors import lognormal

HOSE, ALL_WALLS = lognormal(0.15, 1.0), lognormal(0.01, 1.5)  # compliance ratio
LINE = "line"


def _places(rig):
    return (*segment_places(rig), *(line_place(rig) if len(rig.line) > 1 else ()))


def _is_whole_line(rig, place):
    return place.element == LINE or len(rig.line) == 1


def _apply(network, state, values, place):
    creep = values["compliance_ratio"] / (1.0 + network.s * values["retardation_time"])
    for k in _segments(len(network.shunt), state, place):
        network.shunt[k] = network.shunt[k] * (1.0 + creep)


def _apply_in_time(line, state, values, place):
    # One more retarded strain at each node.
    term = values["compliance_ratio"], values["retardation_time"]
    for k in _segments(len(line.pipes), state, place):
        pipe = line.pipes[k]
        line.pipes[k] = replace(pipe, creep=(*pipe.creep, term))


def _segments(count, state, place):
    """Indices of the segments, of `count`, whose wall creeps as the effect at `place` says."""
    if place.element != LINE:
        return [place.index]
    hoses = {p.index for effect, p in state.effects if effect.name == EFFECT.name}
    return [k for k in range(count) if k not in hoses]


EFFECT = Effect(
    name="viscoelastic_wall",
    element="segment",
    medium="liquid",
    equation="Y' = A s/(rho a^2) (1 + kappa/(1 + s tau))",
    source="Franke & Seyler 1983, J. Hydraulic Res. 21:349; one Kelvin-Voigt element, "
    "Covas et al. 2005, J. Hydraulic Res. 43:56, eq. 10",
    parameters=lambda rig, place: (
        Parameter("compliance_ratio", "1", ALL_WALLS if _is_whole_line(rig, place) else HOSE),
        Parameter("retardation_time", "s", lognormal(3e-4, 1.3), (-1.0, 0.7)),
    ),
    places=_places,
    apply=_apply,
    apply_in_time=_apply_in_time,
    usual=_is_whole_line,
)
