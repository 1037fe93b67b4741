"""Where along the line an accepted effect may sit: one valley after the other.

An effect that may be anywhere has as many valleys as the line has waves. The one that a search ends
in may be wrong, for the line that the effect was first put on had been bent to do without it; and
another may do as well, which few sensors cannot tell.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rippletwin.explain.fit import Fit
from rippletwin.explain.steps import BETTER
from rippletwin.explain.thresholds import EQUIVALENT
from rippletwin.explain.workers import Workers, carry, ranked

PLACES = 2  # on the shortest wave: as many valleys
APART = 0.25  # of the shortest wave, by which two seats differ


def seated(pool: Workers, best: Fit) -> tuple[Fit, list[Fit]]:
    """`best`, or what it becomes in a better seat, and the fits with one effect in another seat
    within EQUIVALENT of it, best first."""
    found = seats(pool, best)
    if found and found[0].evidence > best.evidence + BETTER:
        return seated(pool, found[0])
    return best, [f for f in found if f.evidence > best.evidence - EQUIVALENT]


def seats(pool: Workers, best: Fit) -> list[Fit]:
    """Fits with each effect that may be anywhere begun at every wave along the line, all else as it
    is, best first: none of them where `best` is, no two of them the same.

    None of a line that stores beyond proportion, where each would take long.
    """
    if best.stores:
        return []
    waves = best.twin.rig.delay * max(o.frequency_hz[-1] for o in pool.observations)
    count, apart = int(np.ceil(PLACES * waves)), APART * best.twin.rig.length / waves
    taken = [positions(best)]
    jobs = []
    for k, (effect, place) in enumerate(best.hypothesis):
        if place.element != "position":
            continue
        hypothesis = (*best.without(k), (effect, place))
        at = pool.base.with_(effects=hypothesis).index[f"{effect.name}@{place}.position"]
        start = carry(best, hypothesis, pool.base)
        prior = best.twin.parameters[best.twin.index[f"{effect.name}@{place}.position"]].prior
        for share in (np.arange(count) + 0.5) / count:
            theta = start.copy()
            theta[at] = prior.coordinate(prior.centre + prior.scale * share)
            jobs.append({"hypothesis": hypothesis, "theta": theta, "exact": False})
    found = []
    for fit in ranked(pool.fit(jobs)):
        here = positions(fit)
        if all(any(abs(here[n] - p[n]) > apart for n in here) for p in taken):
            taken.append(here)
            found.append(fit)
    return found


def positions(fit: Fit) -> dict[str, float]:
    """Positions (m) of effects that may be anywhere, by the effect's name."""
    values = fit.twin.values()
    return {
        effect.name: values[f"{effect.name}@{place}.position"]
        for effect, place in fit.hypothesis
        if place.element == "position"
    }


def classes(best: Fit, others: Sequence[Fit]) -> tuple[tuple[str, ...], ...]:
    """Of each effect of `best` that `others` have in other seats, all of them: "name at x m"."""
    found = []
    for name, x in positions(best).items() if others else ():
        moved = [f for f in others if f.hypothesis[-1][0].name == name]
        if moved:
            places = sorted([x, *(positions(f)[name] for f in moved)])
            found.append(tuple(f"{name} at {x:.2f} m" for x in places))
    return tuple(found)
