"""A dead-ended branch: a gauge line, a blocked port, a quarter-wave resonator."""

from __future__ import annotations

import numpy as np

from rippletwin.line.frequency_domain.line_network import Insert
from rippletwin.line.frequency_domain.pipe_immittance import series_impedance, shunt_admittance
from rippletwin.line.time_domain.line_elements import Branch, Pipe
from rippletwin.twin.effects.base import (
    Effect,
    on_line,
    position_parameter,
    position_place,
    segment_at,
)
from rippletwin.twin.parameters import Parameter
from rippletwin.twin.priors import lognormal


def branch_admittance(s, length, diameter, wave_speed, density, viscosity, friction):
    """Input admittance sqrt(Y'/Z') tanh(l sqrt(Z' Y')) of a closed branch, m3/(Pa s).

    `s` (F,) in 1/s, the rest in SI units, broadcast; `friction` as in `series_impedance`.
    """
    series = series_impedance(
        s, density=density, viscosity=viscosity, diameter=diameter, friction=friction
    )
    shunt = shunt_admittance(s, density=density, wave_speed=wave_speed, diameter=diameter)
    return np.sqrt(shunt / series) * np.tanh(length * np.sqrt(series * shunt))


def _apply(network, state, values, place):
    k = segment_at(network.lengths, values["position"])
    admittance = branch_admittance(
        network.s,
        values["length"],
        values["diameter"],
        state.wave_speeds[k],
        state.density,
        values["viscosity_ratio"] * state.viscosity,
        state.friction,
    )
    network.inserts.append(Insert(on_line(network, values["position"]), "shunt", admittance))


def _apply_in_time(line, state, values, place):
    # A pipe of its own at a junction, its far end closed.
    k = segment_at([pipe.length for pipe in line.pipes], values["position"])
    pipe = Pipe(values["length"], values["diameter"], state.wave_speeds[k])
    ratio = values["viscosity_ratio"]
    line.inserts.append(Branch(on_line(line, values["position"]), pipe, ratio))


EFFECT = Effect(
    name="side_branch",
    element="position",
    medium="any",
    equation="q1 - q2 = Y p, Y = sqrt(Y'/Z') tanh(l_b sqrt(Z' Y')), Z' by the line's friction law",
    source="Wylie & Streeter 1993, sec. 12.5",
    parameters=lambda rig, place: (
        position_parameter(rig),
        Parameter("length", "m", lognormal(0.4, 0.8), (-1.2, 0.0, 1.2)),
        Parameter("diameter", "m", lognormal(0.6 * rig.line[0].diameter, 0.5)),
        # Oil in a dead end is as cold as the room, and fittings add losses: at resonance these
        # alone determine how sharp the notch is.
        Parameter("viscosity_ratio", "1", lognormal(1.0, 1.0)),
    ),
    places=position_place,
    apply=_apply,
    apply_in_time=_apply_in_time,
    limits=(("line_volume", None),),  # where it is short against the wave
)
