"""The decision: from the fits and checks to one of six verdicts, with abstention.

A name is given only to an explanation that leaves no more than the model error, has plausible
parameters and holds on held-out data. Otherwise nothing is missing, or the verdict is
`unexplained`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rippletwin.calibration.fit import Fit
from rippletwin.explanation.checks.alarms import Alarms, largest_effect_pull
from rippletwin.explanation.checks.bootstrap import NullDistribution
from rippletwin.explanation.checks.cross_validation import Validation
from rippletwin.explanation.checks.prior_sensitivity import PriorSensitivity
from rippletwin.explanation.search.position_search import equivalent_positions
from rippletwin.explanation.search.stepwise_search import Search
from rippletwin.explanation.thresholds import (
    DECISIVE_LOG_BAYES_FACTOR,
    EQUIVALENT_LOG_BAYES_FACTOR,
    GOOD_MODEL_ERROR,
    MAX_MODEL_ERROR_TO_NAME,
    MIN_LOG_BAYES_FACTOR,
    PULL_ALARM,
)
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import is_limit

VERDICTS = ("consistent", "named", "ambiguous", "unexplained", "calibration_only", "bad_data")


@dataclass(frozen=True)
class Decision:
    """The verdict and its basis.

    verdict        one of VERDICTS
    accepted       the fit whose twin later stages use
    equivalents    classes of effect names that fit equally well
    contradiction  for `bad_data`: what contradicts what, in words
    """

    verdict: str
    accepted: Fit
    equivalents: tuple[tuple[str, ...], ...] = ()
    contradiction: str = ""


def decide(
    search: Search,
    alarms: Alarms,
    validation: Validation | None,
    contradiction: str = "",
    null_distribution: NullDistribution | None = None,
) -> Decision:
    """Compare the best explanation with the base, the passive networks and the checks.

    validation         of the best explanation; None if nothing is explained
    contradiction      why the data contradict themselves, if they do
    null_distribution  of the evidence without an effect, if it was asked for
    """
    best = search.best
    if contradiction:
        return Decision("bad_data", search.base, contradiction=contradiction)
    network = search.passive_networks[0] if search.passive_networks else None
    if network is not None:
        if network.evidence > best.evidence + evidence_needed_by_network(best):
            return Decision("unexplained", network)
    if not best.hypothesis:
        return _nothing_missing(best, alarms)
    log_bayes_factor = search.log_bayes_factor(best)
    if null_distribution is not None and log_bayes_factor < null_distribution.threshold:
        return _nothing_missing(search.base, alarms)
    fails = validation is not None and not validation.passes
    if fails and "misfit" not in alarms.raised:
        weak = log_bayes_factor < DECISIVE_LOG_BAYES_FACTOR
        if not weak and not validation.fits_better:
            # The evidence comes from the data sheet alone, which may be off.
            return _nothing_missing(search.base, alarms, "calibration_only")
        if weak or not validation.transfers:
            # The line fits without this effect and held-out data contradict it: it only absorbs
            # error.
            return _nothing_missing(search.base, alarms)
    is_implausible = (
        best.model_error > MAX_MODEL_ERROR_TO_NAME or largest_effect_pull(best) > PULL_ALARM
    )
    if is_implausible or fails:
        # The twin takes the best description all the same.
        use_network = network is not None and network.evidence > best.evidence
        return Decision("unexplained", network if use_network else best)
    classes = equivalent_effects(search)
    return Decision("ambiguous" if classes else "named", best, classes)


def withdraw_refuted_name(
    decision: Decision, prior_sensitivity: Sequence[PriorSensitivity]
) -> Decision:
    """`decision` without names if a fit with wide priors refutes one of them.

    The residual was attributed to the ripple's error, but moving one line parameter far from the
    data sheet explains it better. Neither the data sheet nor the library says what is missing.
    """
    is_named = decision.verdict in ("named", "ambiguous")
    if is_named and any(sensitivity.refutes for sensitivity in prior_sensitivity):
        return replace(decision, verdict="unexplained", equivalents=())
    return decision


def _nothing_missing(base: Fit, alarms: Alarms, verdict: str = "consistent") -> Decision:
    """The line alone: `verdict`, or `unexplained` if an alarm says that it does not fit."""
    if "misfit" in alarms.raised or "drift" in alarms.raised:
        return Decision("unexplained", base)
    off_data_sheet = {"pull", "disagreement"} & set(alarms.raised)
    return Decision("calibration_only" if off_data_sheet else verdict, base)


def evidence_needed_by_network(best: Fit) -> float:
    """Log evidence by which a passive network must exceed the best named explanation.

    Infinite where that is a good fit, to which a network adds nothing.
    """
    if not best.hypothesis:
        return MIN_LOG_BAYES_FACTOR
    return np.inf if best.model_error <= GOOD_MODEL_ERROR else EQUIVALENT_LOG_BAYES_FACTOR


def equivalent_effects(search: Search) -> tuple[tuple[str, ...], ...]:
    """Classes of effect names: an accepted effect and those that fit equally well in its place."""
    classes = [
        tuple(sorted({name, *(effect.name for effect, _, _ in substitutes)}))
        for (name, _), substitutes in _equivalent_substitutes(search)
    ]
    return tuple(names for names in classes if len(names) > 1)


def equivalent_places(search: Search) -> tuple[tuple[str, ...], ...]:
    """Classes of places at which one effect fits equally well, "name at place" each.

    For example the gains of two sensors, of which only the ratio is known, or positions along the
    line. The effect is named all the same.
    """
    classes = []
    for (name, place), substitutes in _equivalent_substitutes(search):
        others = {f"{name} at {where}" for effect, where, _ in substitutes if effect.name == name}
        classes.append(tuple(sorted({f"{name} at {place}", *others})))
    return (
        *(places for places in classes if len(places) > 1),
        *equivalent_positions(search.best, _fits_at_other_positions(search)),
    )


def rival_fits(search: Search) -> list[Fit]:
    """Fits equivalent to the best explanation that differ from it in one effect or its place."""
    substitutes = [
        fit for _, substitutes in _equivalent_substitutes(search) for _, _, fit in substitutes
    ]
    return [*substitutes, *_fits_at_other_positions(search)]


def _fits_at_other_positions(search: Search) -> list[Fit]:
    """The other positions of the search that still belong to its best hypothesis."""
    return [f for f in search.other_positions if set(f.hypothesis) == set(search.best.hypothesis)]


def _equivalent_substitutes(search: Search) -> list[tuple[tuple[str, Place], list[tuple]]]:
    """For each accepted effect (name, place): equivalent fits with another effect in its place.

    As (effect, place, fit). An always-present effect has none: it is known to be there, whatever
    else could do its work. Neither has an effect those of which it is a limit: they fit as well
    whatever the data are, and the search has taken the limit (`simplify_effects`).
    """
    best, table = search.best, []
    for k, own in enumerate(best.hypothesis):
        if own[0].certain:
            continue
        rest, substitutes = set(best.without(k)), []
        for fit in search.rivals:
            is_close = best.evidence - fit.evidence < EQUIVALENT_LOG_BAYES_FACTOR
            others = set(fit.hypothesis) - rest
            if is_close and rest < set(fit.hypothesis) and len(others) == 1 and own not in others:
                ((effect, place),) = others
                if not is_limit(own, (effect, place), best.twin.rig):
                    substitutes.append((effect, place, fit))
        table.append(((own[0].name, own[1]), substitutes))
    return table


def posterior_probabilities(search: Search, accepted: Fit) -> dict[str, float]:
    """Posterior probability of each accepted effect among all hypotheses that were tried.

    All of them have the same prior probability.
    """
    fits: list[Fit] = [
        search.base,
        *search.single_effect_fits,
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
