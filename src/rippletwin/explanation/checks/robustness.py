"""Does an effect keep its evidence if any element of the line may err without a law?

A real line is never made of the library alone. What the library lacks leaves a remainder, and an
effect that is not there may be accepted because it fits some of it. So each effect is judged beside
a free, smooth correction (`localise.smooth_corrections`) of one element in turn: the log evidence
of the line with the effect is compared with that of the line without it, with the same correction
in both. Without a correction the line without the effect may also leave its data sheet. Both
freedoms together would refute any effect: a tube of another bore with an unlisted error at its end
has the loss of any friction. (Brynjarsdottir and O'Hagan 2014, Inverse Problems 30:114007, on why a
discrepancy must be modelled, and must have structure.)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from rippletwin.explanation.localise.elements import NONE


@dataclass(frozen=True)
class Robustness:
    """What remains of an effect's log evidence if an element may err without a law.

    plain      log Bayes factor without any correction, against a line with a free data sheet too
    least      the least over the corrections of all elements but its own
    element    the element (kind, where) whose correction leaves the least
    own        with a free correction at its own place: from 0 on its law suffices there
    """

    plain: float
    least: float
    element: tuple
    own: float


def compare_beside_corrections(
    present: Mapping[tuple, float],
    absent: Sequence[Mapping[tuple, float]],
    own: tuple,
    spacing: float,
) -> Robustness:
    """`Robustness` of an effect: its model against the best of several models without it.

    present, absent   log evidence by element, of `SmoothCorrections.by_element`; an element that a
                      model without the effect lacks is not compared with it
    own               the effect's own element
    spacing           m within which two elements of one kind are at one position
    """
    factors = {
        e: value - max(each[e] for each in absent if e in each)
        for e, value in present.items()
        if any(e in each for each in absent)
    }
    others = {e: factor for e, factor in factors.items() if not _are_one(e, own, spacing)}
    element = min(others, key=others.get)
    return Robustness(factors[(NONE, None)], others[element], element, factors[own])


def _are_one(element: tuple, own: tuple, spacing: float) -> bool:
    """Whether an element cannot be told from an effect's own."""
    (kind, where), (own_kind, own_where) = element, own
    if kind != own_kind or kind not in ("shunt", "series"):
        return element == own
    return abs(where - own_where) < spacing
