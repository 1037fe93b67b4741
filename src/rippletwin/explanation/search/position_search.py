"""Where along the line an accepted effect may sit: one valley after the other.

An effect that may be anywhere has as many valleys as the line has waves. The one that a search ends
in may be wrong, for the line that the effect was first put on had been bent to do without it; and
another may do as well, which few sensors cannot tell.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rippletwin.calibration.fit import Fit
from rippletwin.explanation.fit_jobs import Workers, rank_by_evidence, transfer_theta
from rippletwin.explanation.search.stepwise_moves import MIN_GAIN
from rippletwin.explanation.thresholds import EQUIVALENT

STARTS_PER_WAVE = 2  # on the shortest wave: as many valleys
MIN_DISTANCE_IN_WAVES = 0.25  # of the shortest wave, by which two seats differ


def move_to_best_position(pool: Workers, best: Fit) -> tuple[Fit, list[Fit]]:
    """`best`, or what it becomes in a better seat, and the fits with one effect in another seat
    within EQUIVALENT of it, best first."""
    found = fit_other_positions(pool, best)
    if found and found[0].evidence > best.evidence + MIN_GAIN:
        return move_to_best_position(pool, found[0])
    return best, [f for f in found if f.evidence > best.evidence - EQUIVALENT]


def fit_other_positions(pool: Workers, best: Fit) -> list[Fit]:
    """Fits with each effect that may be anywhere begun at every wave along the line, all else as it
    is, best first: none of them where `best` is, no two of them the same.

    None of a line that stores beyond proportion, where each would take long.
    """
    if best.has_nonlinear_compliance:
        return []
    waves = best.twin.rig.delay * max(o.frequency_hz[-1] for o in pool.observations)
    count, apart = (
        int(np.ceil(STARTS_PER_WAVE * waves)),
        MIN_DISTANCE_IN_WAVES * best.twin.rig.length / waves,
    )
    taken = [positions_of_effects(best)]
    jobs = []
    for k, (effect, place) in enumerate(best.hypothesis):
        if place.element != "position":
            continue
        hypothesis = (*best.without(k), (effect, place))
        at = pool.base.with_(effects=hypothesis).index[f"{effect.name}@{place}.position"]
        start = transfer_theta(best, hypothesis, pool.base)
        prior = best.twin.parameters[best.twin.index[f"{effect.name}@{place}.position"]].prior
        for share in (np.arange(count) + 0.5) / count:
            theta = start.copy()
            theta[at] = prior.coordinate(prior.centre + prior.scale * share)
            jobs.append({"hypothesis": hypothesis, "theta": theta, "exact": False})
    found = []
    for fit in rank_by_evidence(pool.fit(jobs)):
        here = positions_of_effects(fit)
        if all(any(abs(here[n] - p[n]) > apart for n in here) for p in taken):
            taken.append(here)
            found.append(fit)
    return found


def positions_of_effects(fit: Fit) -> dict[str, float]:
    """Positions (m) of effects that may be anywhere, by the effect's name."""
    values = fit.twin.values()
    return {
        effect.name: values[f"{effect.name}@{place}.position"]
        for effect, place in fit.hypothesis
        if place.element == "position"
    }


def equivalent_positions(best: Fit, others: Sequence[Fit]) -> tuple[tuple[str, ...], ...]:
    """Of each effect of `best` that `others` have in other seats, all of them: "name at x m"."""
    found = []
    for name, x in positions_of_effects(best).items() if others else ():
        moved = [f for f in others if f.hypothesis[-1][0].name == name]
        if moved:
            places = sorted([x, *(positions_of_effects(f)[name] for f in moved)])
            found.append(tuple(f"{name} at {x:.2f} m" for x in places))
    return tuple(found)
