"""A dead-ended branch: a gauge line, a blocked port, a quarter-wave resonator."""

from __future__ import annotations

import numpy as np

from rippletwin.effects.base import (
    Effect,
    Parameter,
    lognormal,
    on_line,
    position_parameter,
    position_place,
    segment_at,
)
from rippletwin.line.chain import Insert
from rippletwin.line.parts import Branch, Pipe


def branch_admittance(s, length, diameter, wave_speed, density, viscosity, loss=1.0):
    """Input admittance A/(rho a) sqrt(s/z) tanh(l sqrt(s z)/a) of a closed branch, m3/(Pa s).

    z = s (1 + 2 c/r), r = R sqrt(s/nu), is the laminar boundary layer to first order, `loss` c
    times: what a branch holds, its fittings and its end are known less well than the line's oil,
    and at resonance its loss alone decides how sharp it is.
    """
    area = 0.25 * np.pi * diameter**2
    root = np.sqrt(1.0 + 2.0 * loss / (0.5 * diameter * np.sqrt(s / viscosity)))
    return area / (density * wave_speed * root) * np.tanh(length * s * root / wave_speed)


def _apply(network, line, values, place):
    k = segment_at(network.lengths, values["position"])
    admittance = branch_admittance(
        network.s,
        values["length"],
        values["diameter"],
        line.wave_speeds[k],
        line.density,
        line.viscosity,
        values["loss"],
    )
    network.inserts.append(Insert(on_line(network, values["position"]), "shunt", admittance))


def _in_time(line, state, values, place):
    # A pipe of its own at a junction, its far end closed.
    k = segment_at([pipe.length for pipe in line.pipes], values["position"])
    pipe = Pipe(values["length"], values["diameter"], state.wave_speeds[k])
    line.inserts.append(Branch(on_line(line, values["position"]), pipe, values["loss"]))


EFFECT = Effect(
    name="side_branch",
    element="position",
    medium="any",
    equation="q1 - q2 = Y p, Y = A_b/(rho a sqrt(1 + 2 c/r)) tanh(s l_b sqrt(1 + 2 c/r)/a)",
    source="Wylie & Streeter 1993, sec. 12.5 (branch); Zielke 1968 (loss, first order in 1/r)",
    parameters=lambda rig, place: (
        position_parameter(rig),
        Parameter("length", "m", lognormal(0.4, 0.8), (-1.2, 0.0, 1.2)),
        Parameter("diameter", "m", lognormal(0.6 * rig.line[0].diameter, 0.5)),
        # Between a steady friction's, some 0.2 at a resonance, and that of fittings.
        Parameter("loss", "1", lognormal(0.7, 0.7)),
    ),
    places=position_place,
    apply=_apply,
    in_time=_in_time,
)
