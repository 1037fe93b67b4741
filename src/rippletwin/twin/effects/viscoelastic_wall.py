"""A viscoelastic (hose) wall: creep adds compliance at low frequency and loss around 1/tau."""

from __future__ import annotations

from dataclasses import replace

from rippletwin.twin.effects.base import Effect, segment_places
from rippletwin.twin.parameters import Parameter
from rippletwin.twin.priors import lognormal


def _apply(network, state, values, place):
    creep = values["compliance_ratio"] / (1.0 + network.s * values["retardation_time"])
    network.shunt[place.index] = network.shunt[place.index] * (1.0 + creep)


def _apply_in_time(line, state, values, place):
    # One more retarded strain at each node.
    pipe = line.pipes[place.index]
    term = values["compliance_ratio"], values["retardation_time"]
    line.pipes[place.index] = replace(pipe, creep=(*pipe.creep, term))


EFFECT = Effect(
    name="viscoelastic_wall",
    element="segment",
    medium="liquid",
    equation="Y' = A s/(rho a^2) (1 + kappa/(1 + s tau))",
    source="Franke & Seyler 1983, J. Hydraulic Res. 21:349; one Kelvin-Voigt element, "
    "Covas et al. 2005, J. Hydraulic Res. 43:56, eq. 10",
    parameters=lambda rig, place: (
        Parameter("compliance_ratio", "1", lognormal(0.15, 1.0)),
        Parameter("retardation_time", "s", lognormal(3e-4, 1.3), (-1.0, 0.7)),
    ),
    places=segment_places,
    apply=_apply,
    apply_in_time=_apply_in_time,
)
