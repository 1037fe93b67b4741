"""From fits to a verdict: what is named, what cannot be told apart, what has no name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from rippletwin.calibration.fit import Fit
from rippletwin.calibration.posterior import MIN_MODEL_ERROR
from rippletwin.explanation.checks.alarms import PULL_ALARM, Alarms, largest_effect_pull
from rippletwin.explanation.checks.bootstrap import NullDistribution
from rippletwin.explanation.checks.cross_validation import Validation
from rippletwin.explanation.checks.prior_sensitivity import WithoutEffect
from rippletwin.explanation.search.position_search import equivalent_positions
from rippletwin.explanation.search.stepwise_search import Search
from rippletwin.explanation.thresholds import ACCEPT, EQUIVALENT, GOOD, SURE

VERDICTS = ("consistent", "named", "ambiguous", "unexplained", "calibration_only", "bad_data")

"""Log evidence within which two explanations cannot be told apart: twenty to one."""

MAX_MODEL_ERROR_TO_NAME = 2.0 * MIN_MODEL_ERROR
"""Relative model error above which no name is given. What the source and the sensors are uncertain
by is no part of it: with the true effect it comes down to its least, and what looks alike stops
above (docs/explain.md)."""


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


def decide(
    search: Search,
    alarms: Alarms,
    validation: Validation | None,
    contradiction: str = "",
    by_chance: NullDistribution | None = None,
) -> Judgement:
    """Weigh the search's best explanation against the base, its rivals and the nameless networks.

    `contradiction` says why the data contradict themselves, if they do; `by_chance` what draws
    without an effect gave, where they were asked for.
    """
    best, other = search.best, search.passive_networks[0] if search.passive_networks else None
    if contradiction:
        return Judgement("bad_data", search.base, reason=contradiction)
    nameless = other is not None and other.evidence > best.evidence + evidence_needed_over(
        best, search
    )
    if nameless:
        return Judgement("unexplained", other)
    if not best.hypothesis:
        return _nothing_missing(best, alarms)
    if by_chance is not None and search.gain(best) < by_chance.threshold:
        return _nothing_missing(search.base, alarms)
    fails = validation is not None and not validation.passes
    if fails and "misfit" not in alarms.ringing:
        weak = search.gain(best) < SURE
        if not weak and not validation.gains:
            # It fits nothing better: the data sheet alone speaks for it, and that may be off.
            return _nothing_missing(search.base, alarms, "calibration_only")
        if weak or not validation.transfers:
            # A line that fits without it, and data left out that speak against it: an absorber.
            return _nothing_missing(search.base, alarms)
    if (
        best.model_error > MAX_MODEL_ERROR_TO_NAME
        or largest_effect_pull(best) > PULL_ALARM
        or fails
    ):
        # Without a name it is modelled all the same, by whatever describes the data best.
        stands_in = other is not None and other.evidence > best.evidence
        return Judgement("unexplained", other if stands_in else best)
    classes = equivalent_effects(search)
    return Judgement("ambiguous" if classes else "named", best, classes)


def withdraw_refuted_name(judgement: Judgement, without: Sequence[WithoutEffect]) -> Judgement:
    """The judgement once it is known what a free data sheet would make of the data `without` each
    accepted effect: no name is left where one of them refutes it.

    What the explanation leaves in the data has then been put down to the ripple's error, and is
    nothing of the kind: one number of the line, far from the sheet, accounts for it. Which is
    missing neither the sheet nor the library says.
    """
    if judgement.verdict in ("named", "ambiguous") and any(w.refutes for w in without):
        return replace(judgement, verdict="unexplained", equivalents=())
    return judgement


def _nothing_missing(base: Fit, alarms: Alarms, verdict: str = "consistent") -> Judgement:
    """The line alone, if no alarm says that it does not fit; `verdict` where none rings."""
    if "misfit" in alarms.ringing or "drift" in alarms.ringing:
        return Judgement("unexplained", base)
    calibrated = {"pull", "disagreement"} & set(alarms.ringing)
    return Judgement("calibration_only" if calibrated else verdict, base)


def evidence_needed_over(best: Fit, search: Search) -> float:
    """Log evidence by which a nameless network must beat the best named explanation.

    Where the named one is as good as can be believed the nameless has nothing to add.
    """
    if not best.hypothesis:
        return ACCEPT
    return np.inf if best.model_error <= GOOD else EQUIVALENT


def equivalent_effects(search: Search) -> tuple[tuple[str, ...], ...]:
    """Classes of effect names: each of an accepted effect and of what does as well in its place."""
    found = [tuple(sorted({own, *(name for _, name in r)})) for (own, _), r in _substitutes(search)]
    return tuple(names for names in found if len(names) > 1)


def equivalent_places(search: Search) -> tuple[tuple[str, ...], ...]:
    """Classes of places at which one effect does alike, as of two sensors' gains of which only the
    ratio is seen, or along the line: "name at place" each. The effect has a name all the same."""
    found = []
    for (own, place), stand_ins in _substitutes(search):
        at = {f"{own} at {where}" for (fit, where), name in stand_ins if name == own}
        found.append(tuple(sorted({f"{own} at {place}", *at})))
    return (
        *(names for names in found if len(names) > 1),
        *equivalent_positions(search.best, _current_positions(search)),
    )


def rival_fits(search: Search) -> list[Fit]:
    """Fits as good as the best explanation that differ from it in one effect, or in its place."""
    others = [fit for _, stand_ins in _substitutes(search) for (fit, _), _ in stand_ins]
    return [*others, *_current_positions(search)]


def _current_positions(search: Search) -> list[Fit]:
    """The search's seats that are still those of its best explanation."""
    return [f for f in search.other_positions if set(f.hypothesis) == set(search.best.hypothesis)]


def _substitutes(search: Search) -> list[tuple[tuple, list[tuple]]]:
    """Of each accepted effect (name, place) the fits within EQUIVALENT of the best explanation that
    have another effect or place for it, as ((fit, place), name).

    What no line is without is known to be there; what could do its work besides is no rival.
    """
    best, found = search.best, []
    for k, own in enumerate(best.hypothesis):
        if own[0].certain:
            continue
        rest, others = set(best.without(k)), []
        for fit in search.rivals:
            close = best.evidence - fit.evidence < EQUIVALENT
            other = set(fit.hypothesis) - rest
            if close and rest < set(fit.hypothesis) and len(other) == 1 and own not in other:
                ((effect, place),) = other
                others.append(((fit, place), effect.name))
        found.append(((own[0].name, own[1]), others))
    return found


def probabilities(search: Search, accepted: Fit) -> dict[str, float]:
    """Posterior probability of each accepted effect, all hypotheses tried being equally likely
    beforehand but for the number of places of an effect."""
    fits: list[Fit] = [
        search.base,
        *search.singles,
        *search.rivals,
        *search.passive_networks,
        accepted,
    ]
    unique = {tuple((e.name, str(p)) for e, p in f.hypothesis): f for f in fits}
    evidence = np.array([f.evidence for f in unique.values()])
    weight = np.exp(evidence - evidence.max())
    weight /= weight.sum()
    return {
        name: float(sum(w for w, f in zip(weight, unique.values()) if name in f.names))
        for name in accepted.names
    }
