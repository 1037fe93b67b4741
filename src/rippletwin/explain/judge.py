"""From fits to a verdict: what is named, what cannot be told apart, what has no name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from rippletwin.explain.bootstrap import Chance
from rippletwin.explain.detect import Alarms
from rippletwin.explain.fit import Fit
from rippletwin.explain.locate import extent
from rippletwin.explain.search import ACCEPT, GOOD, SURE, Search
from rippletwin.explain.validate import Validation

VERDICTS = ("consistent", "named", "ambiguous", "unexplained", "calibration_only", "bad_data")

EQUIVALENT = 3.0
"""Log evidence within which two explanations cannot be told apart: twenty to one."""

ADEQUATE = 5.0 * GOOD
"""Relative model error above which no name is given: an effect that leaves more than this is at
most a part of what is missing."""


@dataclass(frozen=True)
class Judgement:
    """The verdict and what it rests on.

    verdict      one of VERDICTS
    accepted     the fit whose twin later stages use
    equivalents  names that cannot be told apart, each list one class
    reason       for bad data: what contradicts what
    """

    verdict: str
    accepted: Fit
    equivalents: tuple[tuple[str, ...], ...] = field(default=())
    reason: str = ""


def judge(
    search: Search,
    alarms: Alarms,
    validation: Validation | None,
    contradiction: str = "",
    by_chance: Chance | None = None,
) -> Judgement:
    """Weigh the search's best explanation against the base, its rivals and the nameless networks.

    `contradiction` says why the data contradict themselves, if they do; `by_chance` what draws
    without an effect gave, where they were asked for.
    """
    best, other = search.best, search.others[0] if search.others else None
    if contradiction:
        return Judgement("bad_data", search.base, reason=contradiction)
    nameless = other is not None and other.evidence > best.evidence + needed_over(best, search)
    if nameless:
        return Judgement("unexplained", other)
    if not best.hypothesis:
        return _nothing_missing(best, alarms)
    if by_chance is not None and search.gain(best) < by_chance.threshold:
        return _nothing_missing(search.base, alarms)
    fails = validation is not None and not validation.holds
    if fails and "misfit" not in alarms.ringing:
        weak = search.gain(best) < SURE
        if not weak and not validation.gains:
            # It fits nothing better: the data sheet alone speaks for it, and that may be off.
            return _nothing_missing(search.base, alarms, "calibration_only")
        if weak or not validation.transfers:
            # A line that fits without it, and data left out that speak against it: an absorber.
            return _nothing_missing(search.base, alarms)
    if best.floor > ADEQUATE or fails:
        # Without a name it is modelled all the same, by whatever describes the data best.
        stands_in = other is not None and other.evidence > best.evidence
        return Judgement("unexplained", other if stands_in else best)
    classes = equivalents(search)
    return Judgement("ambiguous" if classes else "named", best, classes)


def _nothing_missing(base: Fit, alarms: Alarms, verdict: str = "consistent") -> Judgement:
    """The line alone, if no alarm says that it does not fit; `verdict` where none rings."""
    if "misfit" in alarms.ringing or "drift" in alarms.ringing:
        return Judgement("unexplained", base)
    calibrated = {"pull", "disagreement"} & set(alarms.ringing)
    return Judgement("calibration_only" if calibrated else verdict, base)


def needed_over(best: Fit, search: Search) -> float:
    """Log evidence by which a nameless network must beat the best named explanation.

    Where the named one is as good as can be believed the nameless has nothing to add.
    """
    if not best.hypothesis:
        return ACCEPT
    return np.inf if best.floor <= GOOD else EQUIVALENT


def equivalents(search: Search) -> tuple[tuple[str, ...], ...]:
    """Classes of effect names whose evidence is too close to the best explanation's."""
    close = {name for _, name in _newest(search)}
    return (tuple(sorted(close)),) if len(close) > 1 else ()


def places(search: Search) -> tuple[tuple[str, ...], ...]:
    """Classes of places at which the newest effect does alike, as of two sensors' gains of which
    only the ratio is seen: "name at place" each. The effect has a name all the same."""
    own = search.best.names[-1] if search.best.hypothesis else ""
    close = {f"{own} at {fit.hypothesis[-1][1]}" for fit, name in _newest(search) if name == own}
    return (tuple(sorted(close)),) if len(close) > 1 else ()


def rivals(search: Search) -> list[Fit]:
    """Fits as good as the best explanation that differ from it in their newest effect."""
    return [fit for fit, _ in _newest(search) if fit.hypothesis != search.best.hypothesis]


def _newest(search: Search) -> list[tuple[Fit, str]]:
    """The best explanation and what is within EQUIVALENT of it, each with the effect that differs.

    What no line is without is known to be there; what could do its work besides is no rival.
    """
    best = search.best
    if not best.hypothesis or best.hypothesis[-1][0].certain:
        return []
    kept, found = set(best.hypothesis[:-1]), [(best, best.names[-1])]
    for fit in search.rivals:
        close = best.evidence - fit.evidence < EQUIVALENT
        if not close or len(fit.names) != len(best.names) or fit.hypothesis == best.hypothesis:
            continue
        different = [effect.name for effect, place in fit.hypothesis if (effect, place) not in kept]
        if len(different) == 1:
            found.append((fit, different[0]))
    return found


def probabilities(search: Search, accepted: Fit) -> dict[str, float]:
    """Posterior probability of each accepted effect, all hypotheses tried being equally likely
    beforehand but for the number of places of an effect."""
    fits: list[Fit] = [search.base, *search.singles, *search.rivals, *search.others, accepted]
    unique = {tuple((e.name, str(p)) for e, p in f.hypothesis): f for f in fits}
    evidence = np.array([f.evidence for f in unique.values()])
    weight = np.exp(evidence - evidence.max())
    weight /= weight.sum()
    return {
        name: float(sum(w for w, f in zip(weight, unique.values()) if name in f.names))
        for name in accepted.names
    }


def span(rig, effect, place, parameters: dict) -> tuple[str, list[float]]:
    """Element and interval along the line (m) at which an effect acts."""
    ends = np.cumsum([s.length for s in rig.line])
    starts = ends - [s.length for s in rig.line]
    if "position" in parameters:
        low, high = parameters["position"]["ci95"]
        middle = parameters["position"]["value"]
        k = int(min(np.searchsorted(ends, middle), len(ends) - 1))
        if low >= starts[k] and high <= ends[k]:
            return f"segment {k + 1}", [low, high]
        return between(rig, low, high), [low, high]
    return place.element, list(extent(rig, place.element))


def between(rig, low: float, high: float) -> str:
    """The stretch between sensors, pump and load that holds an interval."""
    marks = [("pump", 0.0), *((s.name, s.position) for s in rig.sensors), ("load", rig.length)]
    marks.sort(key=lambda m: m[1])
    left = [name for name, x in marks if x <= low] or ["pump"]
    right = [name for name, x in marks if x >= high] or ["load"]
    return f"between {left[-1]} and {right[0]}"


def join(words: Sequence[str]) -> str:
    """Words in a row as in a sentence."""
    words = list(words)
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1]
