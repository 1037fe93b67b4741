"""Discretisation of a line: segments into pipes and junctions, elements into steps of time.

Elements and branches divide the segments. Between two pipes is a junction: a ladder of rungs in
order from pump to load. A piece too short for cells of its own (fewer than three) becomes rungs
too, its pi section: half of its capacitance, its inertance, the other half. Of a branch that is so
short the mass that moves is a third of its inertance.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rippletwin.line.time_domain.line_elements import (
    Branch,
    Element,
    Pipe,
    Storage,
    TimeDomainLine,
    capacitance,
)

MIN_CELLS = 3  # of a pipe; a shorter piece becomes a pi section
MAX_PREWARPED = 0.5  # rad a half step: a faster resonance is hardly resolved
SAME_POSITION = 1e-9  # m: positions closer than this are the same


class Piece(NamedTuple):
    """A piece between elements, from `start`, m: `number` k of a pipe with cells, or ~r of one that
    is too short for them, whose pi section begins with rung r of all junctions in a row."""

    start: float
    pipe: Pipe
    number: int


def discretise_element(element: Element, dt: float) -> np.ndarray:
    """(b0, b1, b2, a1, a2), (5,), of the element at steps of `dt`, s, by the trapezoidal rule.

    s = (2/dt)(z - 1)/(z + 1) keeps what is passive passive, hence stable (Dahlquist 1963). It would
    lower a resonance w to (2/dt) arctan(w dt/2): the coefficient of s^2 is divided by so much that
    the resonance stays, and all that is slower than it.
    """
    degree = max(len(element.numerator), len(element.denominator)) - 1
    numerator, denominator = element.numerator, list(element.denominator)
    if len(denominator) == 3:
        square, bend, stiff = denominator
        turn = 0.5 * dt * np.sqrt(stiff / square)
        if bend**2 < 4.0 * square * stiff and turn < MAX_PREWARPED:
            denominator[0] *= (turn / np.tan(turn)) ** 2

    def in_z(coefficients):
        total = np.zeros(degree + 1)
        for power, c in enumerate(coefficients[::-1]):
            term = np.poly(np.r_[np.ones(power), -np.ones(degree - power)])
            total += c * (2.0 / dt) ** power * term
        return np.append(total, np.zeros(2 - degree))

    b, a = in_z(numerator), in_z(denominator)
    return np.array([*b / a[0], *a[1:] / a[0]])


def cells_of(pipe: Pipe, dt: float) -> float:
    """Length of a pipe in cells, at steps of `dt`, s; whole numbers are freed of rounding."""
    cells = pipe.length / (pipe.wave_speed * dt)
    return round(cells) if abs(cells - round(cells)) < 1e-9 * max(cells, 1) else cells


def discretise(line: TimeDomainLine, dt: float) -> tuple[list[Piece], list[list]]:
    """Divide the segments at the elements, for steps of `dt`, s.

    Returns the pieces, pump first, and the rungs of each junction between those that are pipes.
    Raises ValueError for an element outside the line, and where all pieces would be shorter than
    three steps.
    """
    edges = np.concatenate([[0.0], np.cumsum([p.length for p in line.pipes])])
    if any(not 0.0 <= i.position <= edges[-1] * (1 + 1e-12) for i in line.inserts):
        raise ValueError(f"an element lies outside the line of {edges[-1]} m")
    cuts = {i.position for i in line.inserts if np.min(np.abs(edges - i.position)) > SAME_POSITION}
    stops = np.array(sorted(set(edges) | cuts))
    at = [int(np.argmin(np.abs(stops - i.position))) for i in line.inserts]
    pieces, count = [], 0
    joints: list[list[Element | Storage | Branch]] = [[*line.source, *line.passage]]
    for n, x in enumerate(stops):
        if n > 0:
            before = stops[n - 1]
            parent = line.pipes[int(np.searchsorted(edges, before, side="right")) - 1]
            whole = abs((x - before) - parent.length) < 1e-12 * parent.length
            piece = parent if whole else replace(parent, length=float(x - before))
            if cells_of(piece, dt) >= MIN_CELLS:
                pieces.append(Piece(float(before), piece, count))
                joints.append([])
                count += 1
            else:
                pieces.append(Piece(float(before), piece, ~sum(map(len, joints))))
                joints[-1] += _pi_section(piece, line)
        joints[-1] += [_rung(insert, line, dt) for insert, k in zip(line.inserts, at) if k == n]
    joints[-1] += line.load
    if not count:
        raise ValueError("the line is cut into pieces shorter than three steps")
    return pieces, joints


def _rung(
    insert: Element | Storage | Branch, line: TimeDomainLine, dt: float
) -> Element | Storage | Branch:
    """The insert as a rung: a branch too short for cells of its own as its admittance C s/(1 + C
    L/3 s (s + loss)), the first terms of sqrt(Y'/Z') tanh(l sqrt(Z' Y'))."""
    if not isinstance(insert, Branch) or cells_of(insert.pipe, dt) >= MIN_CELLS:
        return insert
    storage, mass, loss = _lumped(insert.pipe, line)
    moved = storage * mass / 3.0
    denominator = moved, moved * loss * insert.viscosity_ratio, 1.0
    return Element(insert.position, "shunt", (storage, 0.0), denominator)


def _lumped(pipe: Pipe, line: TimeDomainLine) -> tuple[float, float, float]:
    """Capacitance, m3/Pa, inertance, Pa s2/m3, and its decay rate by friction, 1/s, of a pipe."""
    area = 0.25 * np.pi * pipe.diameter**2
    loss = 0.0 if line.friction == "none" else 32.0 * line.viscosity / pipe.diameter**2
    storage = area * pipe.length / (line.density * pipe.wave_speed**2)
    return storage, line.density * pipe.length / area, loss


def _pi_section(piece: Pipe, line: TimeDomainLine) -> list[Element]:
    """A piece much shorter than the wave, with an elastic and a yielding wall."""
    piece = piece.linear(line.density)
    storage, mass, loss = _lumped(piece, line)
    half = 0.5 * storage
    side = [capacitance(0.0, half)]
    side += [Element(0.0, "shunt", (half * kappa, 0.0), (tau, 1.0)) for kappa, tau in piece.creep]
    return [*side, Element(0.0, "series", (mass, mass * loss)), *side]
