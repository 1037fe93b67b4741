"""Search over hypotheses: every effect at every place, then pairs and triples, by evidence."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from rippletwin.calibration.fit import Fit
from rippletwin.explanation.fit_jobs import Workers, progress_callback, rank_by_evidence
from rippletwin.explanation.search.position_search import move_to_best_position
from rippletwin.explanation.search.single_effects import fit_single_effects
from rippletwin.explanation.search.stepwise_moves import (
    MIN_GAIN,
    drop_needless_effects,
    exchange_effects,
    fit_extensions,
    fit_substitutes,
    refit_at_exact_mode,
    simplify_effects,
)
from rippletwin.explanation.thresholds import ACCEPT, CERTAIN, needed
from rippletwin.twin.effects.base import Effect, Place
from rippletwin.twin.effects.library import candidates

RIVAL_MARGIN = 4.0 * ACCEPT  # log evidence within which a rival is worth another look


def applicable_candidates(
    rig, observations: Sequence, named: bool = True
) -> list[tuple[Effect, Place]]:
    """The candidates that these data can say anything about."""
    kinds = {o.kind for o in observations}
    found = []
    for effect, place in candidates(rig, named):
        if kinds == {"input_impedance"} and effect.element in ("source", "sensor"):
            continue
        if effect.name == "entrained_air" and "periodic" not in kinds:
            continue
        if effect.name in ("piston_spread", "speed_fluctuation"):
            continue  # act at shaft orders that are not fitted, see `shaft_orders`
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
    passive_networks: list[Fit] = field(default_factory=list)
    other_positions: list[Fit] = field(default_factory=list)

    def gain(self, fit: Fit) -> float:
        """Log evidence over the base."""
        return fit.evidence - self.base.evidence


def search_effects(
    pool: Workers, progress: Callable[[str, int, int], None] | None = None
) -> Search:
    """Forward and backward steps over the library, from the base; see `Search`."""
    found = applicable_candidates(pool.base.rig, pool.observations)
    base, singles = fit_single_effects(pool, found, progress)
    return _stepwise(pool, Search(base, singles, base, singles), found, progress)


def resume_search(pool: Workers, past: Search, progress=None) -> Search:
    """The search on data that differ little from those of `past`: its fits from where they ended,
    and steps from its best, of which what has become needless is dropped first."""
    close = [f for f in past.rivals if past.best.evidence - f.evidence < RIVAL_MARGIN]
    fits = [past.base, *past.singles, past.best, *close]
    exact = {id(f) for f in close if not set(past.best.hypothesis) < set(f.hypothesis)}
    jobs = [
        {"hypothesis": f.hypothesis, "theta": f.twin.theta, "exact": id(f) in exact} for f in fits
    ]
    tell = progress_callback(progress, "again", len(jobs))
    base, *rest = pool.fit(jobs, tell)
    count = len(past.singles)
    singles, best, rivals = (
        rank_by_evidence(rest[:count]),
        rest[count],
        rank_by_evidence(rest[count + 1 :]),
    )
    found = applicable_candidates(pool.base.rig, pool.observations)
    best = refit_at_exact_mode(
        pool,
        simplify_effects(
            pool, exchange_effects(pool, drop_needless_effects(pool, best), singles), found
        ),
    )
    return _stepwise(pool, Search(base, singles, best, rivals), found, progress)


def _stepwise(pool: Workers, begun: Search, found: Sequence, progress) -> Search:
    """Steps forward and back from `begun.best`, with the candidates `found`."""
    base, singles = begun.base, begun.singles
    best, rivals, step = begun.best, begun.rivals, singles
    if best.hypothesis:
        step = fit_extensions(pool, best, found, progress)
    while True:
        new = _accepted_extension(best, step)
        if new is None:
            moved, seats = move_to_best_position(pool, best)
            if moved is best:
                break
            best = moved
        else:
            best, rivals = new, rivals if step is singles else [*rivals, *step]
            best = simplify_effects(
                pool, exchange_effects(pool, drop_needless_effects(pool, best), singles), found
            )
            best = refit_at_exact_mode(pool, best)
        step = fit_extensions(pool, best, found, progress)
    close = fit_substitutes(pool, best, found)
    if close and close[0].evidence > best.evidence + MIN_GAIN:
        best, seats = move_to_best_position(pool, close[0])
    return Search(base, singles, best, [*rivals, *close], other_positions=seats)


def _accepted_extension(best: Fit, step: Sequence[Fit]) -> Fit | None:
    """The fit of a step that goes on from `best`; None where none adds what is needed."""
    if step and step[0].evidence - best.evidence >= needed(step[0]):
        return step[0]
    # What no line is without is taken in with something else, never alone.
    certain = [f for f in step if f.hypothesis[-1][0].certain] if best.hypothesis else []
    return certain[0] if certain and certain[0].evidence - best.evidence >= CERTAIN else None
