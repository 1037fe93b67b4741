"""Search over hypotheses: every effect at every place, then pairs and triples, by evidence."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from rippletwin.effects import Effect, Place, candidates
from rippletwin.explain.fit import Fit
from rippletwin.explain.seats import seated
from rippletwin.explain.singles import alone
from rippletwin.explain.steps import (
    BETTER,
    backward,
    exchange,
    extensions,
    relatives,
    settled,
    simplify,
)
from rippletwin.explain.thresholds import ACCEPT, CERTAIN, needed
from rippletwin.explain.workers import Workers, counter, ranked

CLOSE = 4.0 * ACCEPT  # log evidence within which a rival is worth another look


def library(rig, observations: Sequence, named: bool = True) -> list[tuple[Effect, Place]]:
    """The candidates that these data can say anything about."""
    kinds = {o.kind for o in observations}
    found = []
    for effect, place in candidates(rig, named):
        if kinds == {"input_impedance"} and effect.element in ("source", "sensor"):
            continue
        if effect.name == "entrained_air" and "periodic" not in kinds:
            continue
        if effect.name in ("piston_spread", "speed_fluctuation"):
            continue  # act at shaft orders that are not fitted, see `rippletwin.explain.shaft`
        found.append((effect, place))
    return found


@dataclass
class Search:
    """What the search found.

    base     the paper's line, fitted
    singles  every effect at every place alone, best first
    best     the accepted hypothesis (may be the base)
    rivals   fits of every step that took effects in or could have: alternatives to `best`
    others   passive networks that compete, best first
    seats    `best` with an effect elsewhere along the line that does as well, best first
    """

    base: Fit
    singles: list[Fit]
    best: Fit
    rivals: list[Fit] = field(default_factory=list)
    others: list[Fit] = field(default_factory=list)
    seats: list[Fit] = field(default_factory=list)

    def gain(self, fit: Fit) -> float:
        """Log evidence over the base."""
        return fit.evidence - self.base.evidence


def search(pool: Workers, progress: Callable[[str, int, int], None] | None = None) -> Search:
    """Forward and backward steps over the library, from the base; see `Search`."""
    found = library(pool.base.rig, pool.observations)
    base, singles = alone(pool, found, progress)
    return _stepwise(pool, Search(base, singles, base, singles), found, progress)


def again(pool: Workers, past: Search, progress=None) -> Search:
    """The search on data that differ little from those of `past`: its fits from where they ended,
    and steps from its best, of which what has become needless is dropped first."""
    close = [f for f in past.rivals if past.best.evidence - f.evidence < CLOSE]
    fits = [past.base, *past.singles, past.best, *close]
    exact = {id(f) for f in close if not set(past.best.hypothesis) < set(f.hypothesis)}
    jobs = [
        {"hypothesis": f.hypothesis, "theta": f.twin.theta, "exact": id(f) in exact} for f in fits
    ]
    tell = counter(progress, "again", len(jobs))
    base, *rest = pool.fit(jobs, tell)
    count = len(past.singles)
    singles, best, rivals = ranked(rest[:count]), rest[count], ranked(rest[count + 1 :])
    found = library(pool.base.rig, pool.observations)
    best = settled(pool, simplify(pool, exchange(pool, backward(pool, best), singles), found))
    return _stepwise(pool, Search(base, singles, best, rivals), found, progress)


def _stepwise(pool: Workers, begun: Search, found: Sequence, progress) -> Search:
    """Steps forward and back from `begun.best`, with the candidates `found`."""
    base, singles = begun.base, begun.singles
    best, rivals, step = begun.best, begun.rivals, singles
    if best.hypothesis:
        step = extensions(pool, best, found, progress)
    while True:
        new = _taken(best, step)
        if new is None:
            moved, seats = seated(pool, best)
            if moved is best:
                break
            best = moved
        else:
            best, rivals = new, rivals if step is singles else [*rivals, *step]
            best = simplify(pool, exchange(pool, backward(pool, best), singles), found)
            best = settled(pool, best)
        step = extensions(pool, best, found, progress)
    close = relatives(pool, best, found)
    if close and close[0].evidence > best.evidence + BETTER:
        best, seats = seated(pool, close[0])
    return Search(base, singles, best, [*rivals, *close], seats=seats)


def _taken(best: Fit, step: Sequence[Fit]) -> Fit | None:
    """The fit of a step that goes on from `best`; None where none adds what is needed."""
    if step and step[0].evidence - best.evidence >= needed(step[0]):
        return step[0]
    # What no line is without is taken in with something else, never alone.
    certain = [f for f in step if f.hypothesis[-1][0].certain] if best.hypothesis else []
    return certain[0] if certain and certain[0].evidence - best.evidence >= CERTAIN else None
