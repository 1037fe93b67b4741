"""The effects that a verdict names, against the truth: which count for which, which are there."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

POSITION_TOLERANCE = 0.01
"""Of the line's length, added to both ends of a position's interval: lengths are known to that."""

ESTABLISHED = ("established",)
SUPPORTED_TOO = ("established", "supported")


class Names(NamedTuple):
    """The effects that a verdict names, against the truth.

    true      the concealed effects
    named     the effects that count as named
    there     of each of these, whether it is there, concealed or nuisance physics at its place
    found     pairs (true effect, named effect that counts for it)
    nuisance  the named effects that count for nuisance physics
    """

    true: list[dict]
    named: list[dict]
    there: list[bool]
    found: list[tuple[dict, dict]]
    nuisance: list[dict]

    @property
    def is_right(self) -> bool:
        """Whether every true effect is named, and there is one."""
        return bool(self.true) and len(self.found) == len(self.true)

    @property
    def wrong(self) -> str:
        """The named effects that are not there, as text."""
        return " + ".join(e["name"] for e, there in zip(self.named, self.there) if not there)


def judge_names(truth: dict, verdict: dict, levels: Sequence[str] = ESTABLISHED) -> Names:
    """The effects that the verdict supports at one of these levels, against the seal's content."""
    true, named, length = truth["effects"], named_effects(verdict, levels), truth["length"]
    nuisance = truth.get("nuisance", [])
    classes = [set(names) for names in [*verdict["equivalents"], *truth["classes"]]]
    free = [claim for claim in named if not _is_nuisance(claim, truth, classes)]
    claims = assign_claims(true, free, classes, length)
    rest = [claim for claim in named if not any(claim is each for each in claims)]
    real = [
        claim
        for effect, claim in zip(nuisance, assign_claims(nuisance, rest, [], length))
        if claim is not None and is_place_right(effect, claim, length)
    ]
    there = [any(claim is each for each in [*claims, *real]) for claim in named]
    found = [(effect, claim) for effect, claim in zip(true, claims) if claim is not None]
    return Names(true, named, there, found, real)


def _is_nuisance(claim: dict, truth: dict, classes: Sequence[set]) -> bool:
    """Whether a named effect is nuisance physics at its place, and no concealed one at its."""

    def is_there(effect: dict, names: Sequence[set]) -> bool:
        alike = same_or_equivalent(claim["name"], effect["name"], names)
        return alike and is_place_right(effect, claim, truth["length"])

    nuisance = any(is_there(effect, []) for effect in truth.get("nuisance", []))
    return nuisance and not any(is_there(effect, classes) for effect in truth["effects"])


def named_effects(verdict: dict, levels: Sequence[str] = ESTABLISHED) -> list[dict]:
    """The effects that a verdict supports at one of these levels; none if it is silent."""
    if verdict["verdict"] not in ("named", "ambiguous", "unexplained"):
        return []
    return [e for e in verdict["effects"] if e.get("support", "established") in levels]


def rank_effects(verdict: dict, nuisance: Sequence[dict] = ()) -> list[dict]:
    """The established effects of a verdict, most log evidence first, without those of `nuisance`:
    physics that is there besides what is concealed.

    The evidence is what is lost without the effect (`without[].evidence`), infinite where nothing
    fits without it. Effects at shaft orders have none and come last.
    """
    rows, ranked = list(verdict["without"]), []
    established = named_effects(verdict)
    for effect in verdict["effects"]:
        own = [r for r in rows if r["effect"] == effect["name"]]
        row = next((r for r in own if _is_at(r["place"], effect["element"])), None)
        evidence = -np.inf
        if row is not None:
            rows.remove(row)  # several of one name are in the same order in both lists
            evidence = np.inf if row["evidence"] is None else row["evidence"]
        counts = any(effect is each for each in established)
        if counts and not any(effect is each for each in nuisance):
            ranked.append((evidence, effect))
    return [effect for _, effect in sorted(ranked, key=lambda pair: -pair[0])]


def _is_at(place: str, element: str) -> bool:
    """Whether a place, as "source (volume)" or "position 2", is at an element."""
    return f"{place} ".startswith(f"{element} ")


def same_or_equivalent(name: str, other: str, classes: Sequence[set]) -> bool:
    """Whether two names are equal or in one class of effects that cannot be told apart."""
    return name == other or any({name, other} <= names for names in classes)


def assign_claims(
    true: Sequence[dict], named: Sequence[dict], classes: Sequence[set], length: float
) -> list[dict | None]:
    """For each true effect the named effect that counts for it, or None.

    A named effect counts for one true effect at most, also where its class holds two. The
    assignment finds as many true effects as possible; among those the most by their own names, and
    then the most at their own places. `length` is the line's, m.
    """
    gain = np.zeros((len(true), len(named)))
    for k, effect in enumerate(true):
        for n, claim in enumerate(named):
            if same_or_equivalent(claim["name"], effect["name"], classes):
                same_name = claim["name"] == effect["name"]
                gain[k, n] = 1e4 + 1e2 * same_name + is_place_right(effect, claim, length)
    assigned = [None] * len(true)
    for k, n in zip(*linear_sum_assignment(gain, maximize=True)):
        if gain[k, n] > 0:
            assigned[k] = named[n]
    return assigned


def is_place_right(effect: dict, claim: dict, length: float) -> bool:
    """Whether a claim's element is the true one, or its position's interval holds the true one."""
    position = claim["parameters"].get("position")
    if effect["position"] is not None and position is not None:
        return _holds_position(effect, position["ci95"], length)
    return claim["element"] == effect["element"]


def _holds_position(effect: dict, interval: Sequence[float], length: float) -> bool:
    """Whether the widened interval holds the actual or the nominal position.

    The calibrated line's metres are between the two.
    """
    low = interval[0] - POSITION_TOLERANCE * length
    high = interval[1] + POSITION_TOLERANCE * length
    return low <= effect["position"] <= high or low <= effect["position_nominal"] <= high
