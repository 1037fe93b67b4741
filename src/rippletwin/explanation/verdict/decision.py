"""The decision: from the fits and checks to one of six verdicts, with abstention.

A name is given to what is established (`checks.support`), whatever remains beside it. Where
something is missing and nothing is established, the verdict is `unexplained`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rippletwin.calibration.fit import Fit
from rippletwin.explanation.checks.alarms import Alarms
from rippletwin.explanation.checks.bootstrap import NullDistribution
from rippletwin.explanation.checks.support import Support
from rippletwin.explanation.search.passive_networks import accepted_network
from rippletwin.explanation.search.position_search import equivalent_positions
from rippletwin.explanation.search.stepwise_search import Search
from rippletwin.explanation.thresholds import EQUIVALENT_LOG_BAYES_FACTOR
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import is_limit

VERDICTS = ("consistent", "named", "ambiguous", "unexplained", "calibration_only", "bad_data")


@dataclass(frozen=True)
class Decision:
    """The verdict and its basis.

    verdict        one of VERDICTS
    accepted       the fit whose twin later stages use
    supports       of the effects of the explanation
    equivalents    classes of effect names that fit equally well
    contradiction  for `bad_data`: what contradicts what, in words
    """

    verdict: str
    accepted: Fit
    supports: tuple[Support, ...] = ()
    equivalents: tuple[tuple[str, ...], ...] = ()
    contradiction: str = ""

    @property
    def established(self) -> tuple[str, ...]:
        """Names of the effects that are established."""
        return tuple(s.name for s in self.supports if s.level == "established")


def decide(
    search: Search,
    alarms: Alarms,
    supports: Sequence[Support] = (),
    contradiction: str = "",
    null_distribution: NullDistribution | None = None,
) -> Decision:
    """Decide by the support of the effects of the best explanation, and by the alarms.

    supports          of the effects of `search.best`, beside the network that is accepted
    contradiction     why the data contradict themselves, if they do
    null_distribution of the evidence without an effect, if it was asked for
    """
    best = search.best
    if contradiction:
        return Decision("bad_data", search.base, contradiction=contradiction)
    network = accepted_network(search)
    if null_distribution is not None and best.hypothesis:
        if search.log_bayes_factor(best) < null_distribution.threshold:
            return _nothing_missing(search.base, alarms)
    if network is not None and not set(best.hypothesis) <= set(network.hypothesis):
        # Begun anew, and better than all that was named: the supports are those of another line.
        return Decision("unexplained", network)
    accepted, supports = network or best, tuple(supports)
    levels = {support.level for support in supports}
    if "established" in levels:
        classes = equivalent_effects(search)
        return Decision("ambiguous" if classes else "named", accepted, supports, classes)
    if "supported" in levels or network is not None:
        return Decision("unexplained", accepted, supports)
    if not best.hypothesis:
        return _nothing_missing(best, alarms)
    # What the search suggests comes from the data sheet alone, or does not transfer.
    decision = _nothing_missing(search.base, alarms, "calibration_only")
    if decision.verdict == "unexplained":
        return Decision("unexplained", best, supports)
    return decision


def _nothing_missing(base: Fit, alarms: Alarms, verdict: str = "consistent") -> Decision:
    """The line alone: `verdict`, or `unexplained` if an alarm says that it does not fit."""
    if "misfit" in alarms.raised or "drift" in alarms.raised:
        return Decision("unexplained", base)
    off_data_sheet = {"pull", "disagreement"} & set(alarms.raised)
    return Decision("calibration_only" if off_data_sheet else verdict, base)


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
    """The other positions of the search that still belong to its best hypothesis and are as good.

    The best fit may have come to a better mode since.
    """
    best = search.best
    return [
        f
        for f in search.other_positions
        if set(f.hypothesis) == set(best.hypothesis)
        and best.evidence - f.evidence < EQUIVALENT_LOG_BAYES_FACTOR
    ]


def _equivalent_substitutes(search: Search) -> list[tuple[tuple[str, Place], list[tuple]]]:
    """For each accepted effect (name, place): equivalent fits with another effect in its place.

    As (effect, place, fit). An always-present effect has none: it is known to be there, whatever
    else could do its work. Neither has an effect those of which it is a limit: they fit as well
    whatever the data are, and the search has taken the limit (`simplify_effects`).
    """
    best, table = search.best, []
    for k, own in enumerate(best.hypothesis):
        if own[0].certain(best.twin.rig, own[1]):
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

    All of them have the same prior probability. One that was fitted several times, or with its
    effects in several orders, counts once, by the fit of greatest evidence.
    """
    fits: list[Fit] = [
        search.base,
        *search.single_effect_fits,
        *search.rivals,
        *search.passive_networks,
        accepted,
    ]
    fits.sort(key=lambda fit: fit.evidence)  # the last of a hypothesis is kept
    unique = {frozenset((e.name, str(p)) for e, p in f.hypothesis): f for f in fits}
    evidence = np.array([f.evidence for f in unique.values()])
    weight = np.exp(evidence - evidence.max())
    weight /= weight.sum()
    return {
        name: float(sum(w for w, f in zip(weight, unique.values()) if name in f.names))
        for name in accepted.names
    }
