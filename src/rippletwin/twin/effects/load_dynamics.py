"""A load that responds with delay: a valve spool on its spring, or oil in the valve's passage."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rippletwin.line.frequency_domain.line_network import Insert
from rippletwin.line.time_domain.line_elements import Element, inertance
from rippletwin.twin.effects.base import Effect, Place
from rippletwin.twin.effects.lumped_elements import second_order_lag
from rippletwin.twin.parameters import Parameter
from rippletwin.twin.priors import lognormal, normal


def _places(rig):
    # Without a static resistance there is no valve to move; a closed end has no flow to resist.
    if rig.load.kind == "closed":
        return ()
    column = Place("load", form="inertance")
    return (Place("load", form="spool"), column) if rig.load.kind == "orifice" else (column,)


def _apply(network, state, values, place):
    s, end = network.s, network.length
    if place.form == "inertance":
        network.inserts.append(Insert(end, "series", s * values["inertance"]))
        return
    motion = second_order_lag(s, values["natural_frequency"], values["damping_ratio"])
    opening = values["gain"] * motion
    network.inserts.append(Insert(end, "shunt", opening / state.load_resistance))
    network.opening = opening


def _parameters(rig, place):
    last = rig.line[-1]
    if place.form == "inertance":
        area = 0.25 * np.pi * last.diameter**2
        of_the_pipe = 0.1 * rig.fluid.density / area  # ten centimetres of the last one
        return (Parameter("inertance", "Pa s2/m3", lognormal(of_the_pipe, 1.2)),)
    return (
        Parameter("gain", "1", normal(0.0, 2.0), (0.2,)),
        Parameter("natural_frequency", "Hz", lognormal(400.0, 1.0), (-1.0, 0.5)),
        Parameter("damping_ratio", "1", lognormal(0.4, 0.8)),
    )


def _apply_in_time(line, state, values, place):
    if place.form == "inertance":
        line.inserts.append(inertance(line.length, values["inertance"]))
        return
    w = 2.0 * np.pi * values["natural_frequency"]
    drop = state.mean_pressure - line.end.pressure
    gain = values["gain"] / (
        2.0 * drop
    )  # of the share that opens: see `rippletwin.line.frequency_domain.orifice_load`
    spool = (gain * w**2,), (1.0, 2.0 * values["damping_ratio"] * w, w**2)
    line.end = replace(line.end, valve=Element(line.length, "shunt", *spool))


EFFECT = Effect(
    name="load_dynamics",
    element="load",
    medium="any",
    equation="spool: q = K (1 + y) sqrt(P + p), y = H p/(2 P), "
    "H = g w0^2/(s^2 + 2 zeta w0 s + w0^2); to a small ripple Y_load = (1 + H)/R; "
    "inertance: Z_load = R + s I",
    source="Merritt 1967, Hydraulic Control Systems, sec. 8-2 (spool on its spring, linearised); "
    "Johnston & Edge 1991, Proc. IMechE 205(I):89 (inertance)",
    parameters=_parameters,
    places=_places,
    apply=_apply,
    apply_in_time=_apply_in_time,
)
