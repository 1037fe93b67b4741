"""A short piece of another pipe in the line: a passive two-port of free length, without a name.

What is as long as the waves is no one-port: a hose, a chamber, a fitting of another bore. The piece
replaces a stretch of the line. In the frequency domain that is a two-port at its middle, which
takes the stretch away and puts the piece there: with chain matrices T

    M = T_before^-1 T_piece T_after^-1 = [[1 + Z Y2, Z], [..., 1 + Z Y1]]

and Y1, Z, Y2 is its pi section, exact at every frequency. A sensor inside the piece would read what
the line it replaces would have there. The piece may leak at its middle; what leaks on average is
left to the load.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rippletwin.line.frequency_domain.line_network import Insert
from rippletwin.line.frequency_domain.pipe_immittance import series_impedance, shunt_admittance
from rippletwin.line.time_domain.line_elements import Element
from rippletwin.twin.effects.base import (
    Effect,
    characteristic_admittance,
    on_line,
    position_parameter,
    position_place,
    segment_at,
)
from rippletwin.twin.parameters import Parameter
from rippletwin.twin.priors import lognormal

MAX_SHARE = 0.5  # of the line's length


def _immittances(network, state, values, place) -> tuple[np.ndarray, np.ndarray]:
    """Z' (Pa s/m4) and Y' (m2/(Pa s)) of the piece, (..., F); both are positive real."""
    k, wide = segment_at(network.lengths, values["position"]), values["diameter_ratio"]
    series = series_impedance(
        network.s,
        density=state.density,
        viscosity=state.viscosity,
        diameter=wide * state.diameters[k],
        friction=state.friction,
    )
    elastic = shunt_admittance(
        network.s,
        density=state.density,
        wave_speed=state.wave_speeds[k],
        diameter=state.diameters[k],
    )
    creep = values["compliance_ratio"] / (1.0 + network.s * values["retardation_time"])
    softer = (wide / values["wave_speed_ratio"]) ** 2
    return series, softer * (network.shunt[k] + creep * elastic)


def _describe(values) -> str:
    """The piece in words; its leak is told by its parameter."""
    wide, fast = values["diameter_ratio"], values["wave_speed_ratio"]
    bore, wall = "wider" if wide > 1.0 else "narrower", "stiffer" if fast > 1.0 else "softer"
    kind = bore if abs(np.log(wide)) > abs(np.log(fast)) else wall
    return (
        f"{values['length']:.2f} m of a {kind} pipe, with {wide:.2f} times the diameter and "
        f"{fast:.2f} times the wave speed of the line"
    )


def _extent(total, values):
    """Middle (a float) and length of the piece, m, inside a line of `total` m."""
    length = np.minimum(values["length"], MAX_SHARE * total)
    half = 0.5 * float(np.ravel(length)[0])
    return float(np.clip(np.ravel(values["position"])[0], half, total - half)), length


def _chain(series, shunt, length):
    """Chain matrix (A, B, C, D) of `length` m of pipe, pump side from load side."""
    gamma = np.sqrt(series * shunt)
    zc, turn = gamma / shunt, gamma * length
    return np.cosh(turn), zc * np.sinh(turn), np.sinh(turn) / zc, np.cosh(turn)


def _product(m, n):
    (a, b, c, d), (e, f, g, h) = m, n
    return a * e + b * g, a * f + b * h, c * e + d * g, c * f + d * h


def _stretch(network, start, stop):
    """Chain matrix of the line from `start` to `stop` (m; scalars or (B, 1))."""
    ends, matrix = np.cumsum(network.lengths), (1.0, 0.0, 0.0, 1.0)
    for k, (low, high) in enumerate(zip(ends - network.lengths, ends)):
        inside = np.minimum(stop, high) - np.maximum(start, low)
        if np.max(inside) > 0.0:
            part = _chain(network.series[k], network.shunt[k], np.maximum(inside, 0.0))
            matrix = _product(matrix, part)
    return matrix


def _without(stretch):
    """The inverse of a chain matrix, whose determinant is 1."""
    a, b, c, d = stretch
    return d, -b, -c, a


def _apply(network, state, values, place):
    x, length = _extent(network.length, values)
    before = _stretch(network, x - 0.5 * length, x)
    after = _stretch(network, x, x + 0.5 * length)
    half = _chain(*_immittances(network, state, values, place), 0.5 * length)
    leak = 1.0, 0.0, values["conductance"], 1.0
    piece = _product(_product(half, leak), half)
    a, b, _, d = _product(_product(_without(before), piece), _without(after))
    network.inserts += [
        Insert(x, "shunt", (d - 1.0) / b),
        Insert(x, "series", b),
        Insert(x, "shunt", (a - 1.0) / b),
    ]


def _apply_in_time(line, state, values, place):
    # A pipe of its own in place of the stretch.
    middle, length = _extent(line.length, values)
    low, high = middle - 0.5 * length, middle + 0.5 * length
    own = line.pipes[segment_at([pipe.length for pipe in line.pipes], values["position"])]
    creep = values["compliance_ratio"], values["retardation_time"]
    own = replace(own, creep=(*own.creep, creep)).linear(line.density)
    piece = replace(
        own,
        length=float(length),
        diameter=own.diameter * values["diameter_ratio"],
        wave_speed=own.wave_speed * values["wave_speed_ratio"],
    )
    before, after, end = [], [], 0.0
    for pipe in line.pipes:
        start, end = end, end + pipe.length
        before.append(replace(pipe, length=min(end, low) - start))
        after.append(replace(pipe, length=end - max(start, high)))
    line.pipes = [pipe for pipe in (*before, piece, *after) if pipe.length > 0.0]
    line.inserts.append(Element(on_line(line, middle), "shunt", (values["conductance"],)))


def _parameters(rig, place):
    unit = characteristic_admittance(rig)
    return (
        position_parameter(rig),
        Parameter("length", "m", lognormal(0.2, 0.6), (-1.0, 1.0)),
        Parameter("diameter_ratio", "1", lognormal(1.0, 0.6), (-1.0, 0.0, 1.2)),
        Parameter("wave_speed_ratio", "1", lognormal(0.75, 0.35), (-1.0, 1.0)),
        Parameter("compliance_ratio", "1", lognormal(0.03, 1.5)),
        Parameter("retardation_time", "s", lognormal(1e-4, 1.3)),
        Parameter("conductance", "m3/(Pa s)", lognormal(0.01 * unit, 1.5)),
    )


EFFECT = Effect(
    name="passive_piece",
    element="position",
    medium="any",
    equation="a stretch of the line has Z' of b times its diameter and (b/c)^2 (Y' + kappa/(1 + "
    "s tau) A s/(rho a^2)) in place of its Y', and q1 - q2 = G p at its middle",
    source="Wylie & Streeter 1993, Fluid Transients in Systems, ch. 12 (transfer matrices)",
    parameters=_parameters,
    places=position_place,
    apply=_apply,
    apply_in_time=_apply_in_time,
    immittances=_immittances,
    rank=2,  # it takes a stretch as all else has made it
    describe=_describe,
    named=False,
)
