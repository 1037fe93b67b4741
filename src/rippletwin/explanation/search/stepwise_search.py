"""Stepwise search over hypotheses: single effects, then up to four together, by evidence.

Each round adds the best candidate, and drops and simplifies what it made needless. Where no
extension adds enough evidence, effects are exchanged and moved along the line; the search ends when
that is no better either.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

from rippletwin.calibration.fit import Fit
from rippletwin.explanation.fit_jobs import (
    Workers,
    job_from,
    progress_callback,
    rank_by_evidence,
)
from rippletwin.explanation.search.effect_pairs import fit_best_pairs
from rippletwin.explanation.search.gas_rivals import GAS, has_one_pressure
from rippletwin.explanation.search.position_search import move_to_best_position
from rippletwin.explanation.search.single_effects import fit_single_effects
from rippletwin.explanation.search.stepwise_moves import (
    MIN_IMPROVEMENT,
    drop_needless_effects,
    exchange_effects,
    fit_extensions,
    fit_substitutes,
    refit_at_exact_mode,
    simplify_effects,
)
from rippletwin.explanation.thresholds import (
    GOOD_MODEL_ERROR,
    MIN_LOG_BAYES_FACTOR,
    min_log_bayes_factor_of_newest,
    surplus_evidence,
)
from rippletwin.twin.effects import library
from rippletwin.twin.effects.base import Effect, Place

RIVAL_MARGIN = 4.0 * MIN_LOG_BAYES_FACTOR
"""Log evidence below the best within which a resumed search refits a rival."""
LEADING_SINGLE_EFFECTS = 6
SHAFT_ORDER_EFFECTS = ("piston_spread", "speed_fluctuation")
"""Effects at shaft orders that are not fitted; `localise.shaft_orders` looks for them."""


def applicable_candidates(
    rig, observations: Sequence, named: bool = True
) -> list[tuple[Effect, Place]]:
    """The effects at their places that these observations can show.

    An input impedance shows neither source nor sensors. Entrained air needs a mean pressure, hence
    a periodic recording. A volume of gas needs two: at one it is tried in place of a volume of
    liquid that was accepted (`gas_rivals`).
    """
    kinds = {o.kind for o in observations}
    applicable = []
    for effect, place in library.candidates(rig, named):
        if kinds == {"input_impedance"} and effect.element in ("source", "sensor"):
            continue
        if effect.name == "entrained_air" and "periodic" not in kinds:
            continue
        if effect.name == GAS and has_one_pressure(observations):
            continue
        if effect.name in SHAFT_ORDER_EFFECTS:
            continue
        applicable.append((effect, place))
    return applicable


@dataclass(frozen=True)
class Search:
    """Result of the search.

    base                the line without effects, fitted
    single_effect_fits  every effect at every place alone, or beside the usual effects that the data
                        show; best first
    best                the accepted hypothesis, which may be the base
    rivals              fits of every round in which an effect was or could have been accepted
    passive_networks    passive networks without a name that compete with `best`, best first
    other_positions     `best` with one effect at another, equivalent position, best first
    """

    base: Fit
    single_effect_fits: list[Fit]
    best: Fit
    rivals: list[Fit] = field(default_factory=list)
    passive_networks: list[Fit] = field(default_factory=list)
    other_positions: list[Fit] = field(default_factory=list)

    def log_bayes_factor(self, fit: Fit) -> float:
        """Log evidence of a fit less that of the base."""
        return fit.evidence - self.base.evidence

    @property
    def leading_fits(self) -> list[Fit]:
        """The base, the best fit, the best single effects and the best passive network."""
        singles = self.single_effect_fits[:LEADING_SINGLE_EFFECTS]
        fits = [self.base, self.best, *singles, *self.passive_networks[:1]]
        return list({fit.label: fit for fit in fits}.values())


def search_effects(
    workers: Workers, progress: Callable[[str, int, int], None] | None = None
) -> Search:
    """Search the effect library stepwise, from the line without effects."""
    candidates = applicable_candidates(workers.base.rig, workers.observations)
    base, start, fits = fit_single_effects(workers, candidates, progress)
    return _search_stepwise(workers, Search(base, fits, start, fits), candidates, progress)


def resume_search(workers: Workers, past: Search, progress=None) -> Search:
    """Resume a search on observations that differ little from those of `past`.

    All its fits start from their modes. Effects of its best hypothesis that have become needless
    are dropped before the search goes on. Where it ends at the same hypothesis, exchanges and other
    positions of effects are those of `past`.
    """
    close = [f for f in past.rivals if past.best.evidence - f.evidence < RIVAL_MARGIN]
    groups = [[past.base, past.best], past.single_effect_fits, close, past.other_positions]
    exact = {id(f) for f in close if not set(past.best.hypothesis) < set(f.hypothesis)}
    jobs = [job_from(f, id(f) in exact) for group in groups for f in group]
    refits = iter(workers.fit(jobs, progress_callback(progress, "resumed search", len(jobs))))
    (base, best), *others = [[next(refits) for _ in group] for group in groups]
    single_effect_fits, rivals, other_positions = map(rank_by_evidence, others)
    candidates = applicable_candidates(workers.base.rig, workers.observations)
    best = _revise(workers, best, candidates)
    search = Search(base, single_effect_fits, best, rivals, other_positions=other_positions)
    return _search_stepwise(workers, search, candidates, progress, past.best.label)


def _search_stepwise(
    workers: Workers, start: Search, candidates: Sequence, progress, settled: str | None = None
) -> Search:
    """Go on from `start.best` until no candidate, no substitute and no other position adds enough
    evidence.

    settled   label of a hypothesis whose effects have been exchanged and moved before
    """
    single_effect_fits, best, rivals = start.single_effect_fits, start.best, start.rivals
    extensions = single_effect_fits
    if not any(f.hypothesis[:-1] == best.hypothesis for f in extensions):
        extensions = fit_extensions(workers, best, candidates, progress)
    visited = {frozenset(best.hypothesis)}
    while True:
        extended = _accepted_extension(best, extensions)
        if extended is None and best.label == settled:
            return replace(start, best=best, rivals=[*rivals, *extensions])
        if extended is None:
            moved, other_positions, substitutes = _move_without_extension(
                workers, best, visited, single_effect_fits, candidates
            )
            rivals = [*rivals, *substitutes]
            if moved is None:
                break
            best = moved
        else:
            revised = _revise(workers, extended, candidates)
            if frozenset(revised.hypothesis) in visited:
                # What it adds is dropped or simplified away again: the next one.
                extensions = [f for f in extensions if f is not extended]
                continue
            if extensions is not single_effect_fits:
                rivals = [*rivals, *extensions]
            best = revised
        visited.add(frozenset(best.hypothesis))
        extensions = fit_extensions(workers, best, candidates, progress)
    return Search(start.base, single_effect_fits, best, rivals, other_positions=other_positions)


def _move_without_extension(
    workers: Workers,
    best: Fit,
    visited: set[frozenset],
    single_effect_fits: Sequence[Fit],
    candidates: Sequence,
) -> tuple[Fit | None, list[Fit], list[Fit]]:
    """The fit with which the search goes on where no extension adds enough evidence, None where it
    ends; the other positions of `best`, and the substitutes that were fitted.

    No move leads to a hypothesis that was visited but one to a better position of `best`, which
    adds at least MIN_IMPROVEMENT of log evidence: the search comes to an end.
    """
    exchanged = exchange_effects(workers, best, single_effect_fits)
    if exchanged is not best:
        moved, other_positions = move_to_best_position(workers, exchanged)
        moved = _revise(workers, moved, candidates)
        if frozenset(moved.hypothesis) not in visited:
            return moved, other_positions, []
        # Simplifying has led back from the exchange: `best` itself may have a better position.
    moved, other_positions = move_to_best_position(workers, best)
    if moved is not best:
        return moved, other_positions, []
    # Only two effects at once lead on, or an effect that was not tried beside those that came
    # later.
    pair = _accepted_pair(workers, best, candidates)
    if pair is not None and frozenset(pair.hypothesis) not in visited:
        return pair, other_positions, []
    substitutes = fit_substitutes(workers, best, candidates)
    moved = _better_substitute(workers, best, substitutes, candidates)
    is_new = frozenset(moved.hypothesis) not in visited
    return moved if is_new else None, other_positions, substitutes


def _better_substitute(
    workers: Workers, best: Fit, substitutes: Sequence[Fit], candidates: Sequence
) -> Fit:
    """The best of `substitutes`, revised, where it is better than `best`; `best` where none is."""
    if not substitutes or substitutes[0].evidence <= best.evidence + MIN_IMPROVEMENT:
        return best
    moved, _ = move_to_best_position(workers, substitutes[0])
    return _revise(workers, moved, candidates)


def _accepted_pair(workers: Workers, best: Fit, candidates: Sequence) -> Fit | None:
    """The best extension by two effects, revised, if it adds as much as its effects must; None
    otherwise."""
    if best.model_error <= GOOD_MODEL_ERROR:
        return None
    pair = next(iter(fit_best_pairs(workers, best, candidates)), None)
    if pair is None or pair.evidence < best.evidence + MIN_LOG_BAYES_FACTOR:
        return None
    revised = _revise(workers, pair, candidates)
    return revised if surplus_evidence(revised) >= surplus_evidence(best) else None


def _revise(workers: Workers, best: Fit, candidates: Sequence) -> Fit:
    """Drop and simplify effects of a new hypothesis, and refit it at its exact mode."""
    best = drop_needless_effects(workers, best)
    best = simplify_effects(workers, best, candidates)
    return refit_at_exact_mode(workers, best)


def _accepted_extension(best: Fit, extensions: Sequence[Fit]) -> Fit | None:
    """The best of `extensions`, best first, that adds enough evidence; None if none does.

    An always-present effect needs less beside another effect; alone it needs as much as any.
    """
    for fit in extensions:
        needed = min_log_bayes_factor_of_newest(fit) if best.hypothesis else MIN_LOG_BAYES_FACTOR
        if fit.evidence - best.evidence >= needed:
            return fit
    return None
