"""Moves of the stepwise search: add an effect, exchange one for another, simplify one, drop one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rippletwin.calibration.fit import Fit, Hypothesis
from rippletwin.explanation.fit_jobs import (
    Continuation,
    FitJob,
    NearFit,
    Workers,
    job_from,
    job_without_effect,
    progress_callback,
    rank_by_evidence,
    score_extension,
)
from rippletwin.explanation.fit_starts import common_coordinates, scan_starts
from rippletwin.explanation.search.gas_rivals import fit_gas_rivals
from rippletwin.explanation.thresholds import (
    GOOD_MODEL_ERROR,
    LITTLE_MODEL_ERROR,
    MIN_LOG_BAYES_FACTOR,
    min_log_bayes_factor,
)
from rippletwin.twin.effects.library import is_form_of, is_limit, next_instance

MAX_EFFECTS = 4
"""Different effects in one hypothesis, boundary layers included, the pump's volume and creep of all
walls not. With more, effects that are not there are established in measured tubes."""
MAX_OF_ONE_EFFECT = 4  # at free positions
SUBSTITUTES_TRIED = 10  # best single effects tried in the place of another
MAX_MODEL_ERROR_FOR_EXACT_MODE = 10.0 * LITTLE_MODEL_ERROR
"""Relative model error below which derivatives of the nonlinear compliance lead to the mode."""
WRONG_MODE_MODEL_ERROR = 0.1
"""Relative model error above which a line is probably in a wrong local mode."""
PROMISING = 8
"""Candidates of a round that are fitted at most, those with the best score tests
(`score_extension`)."""
FITTED_TOGETHER = 2
"""Of them: what promises less than the best of those fitted so far has added is left out."""
MIN_PROMISE = 0.5 * MIN_LOG_BAYES_FACTOR  # of a candidate that is fitted
RESTARTED = 3  # extensions of a fit that are also fitted from the data sheet
MIN_IMPROVEMENT = 1.0  # log evidence by which an exchange or another position must be better


def fit_extensions(workers: Workers, best: Fit, candidates: Sequence, progress) -> list[Fit]:
    """Fits of `best` with each further candidate added, best first.

    None goes beyond MAX_EFFECTS and MAX_OF_ONE_EFFECT. Of an effect at a free position one more is
    a candidate. Beside an effect that was searched for only the most promising are fitted, and
    those that are always present.
    """
    rig = workers.base.rig
    jobs = [extension_job(best, c) for c in additions(rig, best.hypothesis, candidates)]
    usual = all(effect.usual(rig, place) for effect, place in best.hypothesis)
    few = len(jobs) <= PROMISING or usual
    certain = [job for job in jobs if _is_certain(rig, job)]
    searched = [job for job in jobs if not _is_certain(rig, job)]
    total = len(jobs) if few else len(certain) + min(len(searched), PROMISING)
    report = progress_callback(progress, f"{len(best.hypothesis) + 1} effects", total)
    if few:
        fits = workers.fit(jobs, report)
    else:
        fits = _fit_promising(workers, best, certain, searched, report)
    fits = rank_by_evidence(fits)
    if fits and fits[0].model_error > GOOD_MODEL_ERROR:
        # What is missing may have led the line into a wrong local mode: start again from the data
        # sheet with the effect in the model. A line in a wrong mode says nothing of which effect.
        in_wrong_mode = fits[0].model_error > WRONG_MODE_MODEL_ERROR
        again = fits if in_wrong_mode else fits[:RESTARTED]
        restarted = workers.fit([restart_job(best, f.hypothesis, rig) for f in again])
        better = [max(pair, key=lambda f: f.evidence) for pair in zip(again, restarted)]
        fits = rank_by_evidence([*better, *fits[len(again) :]])
    return rank_at_exact_modes(workers, best, fits)


def _is_certain(rig, job: FitJob) -> bool:
    """Whether the newest effect of a job is always present."""
    effect, place = job.hypothesis[-1]
    return effect.certain(rig, place)


def _fit_promising(
    workers: Workers, best: Fit, certain: Sequence[FitJob], searched: Sequence[FitJob], report
) -> list[Fit]:
    """Fits of always-present effects, the jobs `certain`, and of those of `searched` that promise
    most, in that order, until one of them has added as much as the next promises."""
    scored = sorted(workers.map(score_extension, searched), key=lambda pair: -pair[0])[:PROMISING]
    fits = workers.fit(certain, report)
    needed = MIN_PROMISE
    while scored and scored[0][0] >= needed:
        batch, scored = scored[:FITTED_TOGETHER], scored[FITTED_TOGETHER:]
        fits += workers.fit([job for _, job in batch], report)
        needed = max(MIN_PROMISE, *(f.evidence - best.evidence for f in fits))
    return fits


def additions(rig, hypothesis: Hypothesis, candidates: Sequence) -> list:
    """The candidates that may still be added, each as the next of its kind.

    Usual effects are tried before the search begins and may always join. Those with parameters take
    none of the MAX_EFFECTS; boundary layers, which have none, do.
    """
    names = {
        effect.name
        for effect, place in hypothesis
        if not (effect.usual(rig, place) and effect.parameters(rig, place))
    }
    instances = [next_instance(candidate, hypothesis) for candidate in candidates]
    return [
        (effect, place)
        for effect, place in filter(None, instances)
        if place.number <= MAX_OF_ONE_EFFECT
        and (effect.usual(rig, place) or len(names | {effect.name}) <= MAX_EFFECTS)
        and not any(is_form_of(member, (effect, place), rig) for member in hypothesis)
    ]


def _exchanges(hypothesis: Hypothesis, k: int, candidates: Sequence) -> list[Hypothesis]:
    """The hypotheses with effect k exchanged for each candidate that is another."""
    rest, (effect, place) = hypothesis[:k] + hypothesis[k + 1 :], hypothesis[k]
    own = effect, replace(place, number=1)
    instances = [next_instance(c, rest) for c in candidates if c != own]
    return [(*rest, instance) for instance in instances if instance is not None]


def extension_job(best: Fit, candidate) -> FitJob:
    """The job that adds a candidate to a fit, from its mode. The form with fewer parameters of the
    same effect at the same element gives way to it."""
    rig = best.twin.rig
    kept = tuple(m for m in best.hypothesis if not is_form_of(candidate, m, rig))
    return FitJob((*kept, candidate), NearFit(best))


def restart_job(best: Fit, hypothesis: Hypothesis, rig) -> FitJob:
    """The job that fits by continuation, with the effects in common at their fitted coordinates."""
    kept = common_coordinates(best, hypothesis)
    starts = tuple({**kept, **start} for start in scan_starts(rig, hypothesis))
    return FitJob(hypothesis, Continuation(starts))


def exchange_effects(workers: Workers, best: Fit, single_effect_fits: Sequence[Fit]) -> Fit:
    """Exchange one effect for another if that is better and the fit is poor.

    The first effect of a search stands in for everything that is missing. Once others are present
    it may be the wrong one. The substitutes are the best single effects.
    """
    if len(best.hypothesis) < 2 or best.model_error <= GOOD_MODEL_ERROR:
        return best
    substitutes = [f.hypothesis[-1] for f in single_effect_fits[:SUBSTITUTES_TRIED]]
    jobs = [
        FitJob(hypothesis, NearFit(best))
        for k, (effect, place) in enumerate(best.hypothesis)
        if not effect.certain(best.twin.rig, place)
        for hypothesis in _exchanges(best.hypothesis, k, substitutes)
    ]
    fits = rank_by_evidence(workers.fit(jobs))
    if not fits or fits[0].evidence < best.evidence + MIN_IMPROVEMENT:
        return best
    return fits[0]


def fit_substitutes(workers: Workers, best: Fit, candidates: Sequence) -> list[Fit]:
    """Fits with one of several effects exchanged, best first.

    Each effect is exchanged for every other on the same element and for itself at every other
    place. These were not tried beside effects that were accepted later. An effect that is always
    present is not exchanged. Where the search does without gas, it is tried in place of each volume
    of liquid (`gas_rivals`).
    """
    members = best.hypothesis if len(best.hypothesis) > 1 else ()
    jobs = []
    for k, (effect, place) in enumerate(members):
        if effect.certain(best.twin.rig, place):
            continue
        alike = [c for c in candidates if c[1].element == place.element or c[0] is effect]
        jobs += [FitJob(hypothesis, NearFit(best)) for hypothesis in _exchanges(members, k, alike)]
    return rank_by_evidence([*workers.fit(jobs), *fit_gas_rivals(workers, best)])


def simplify_effects(workers: Workers, best: Fit, candidates: Sequence) -> Fit:
    """Replace each effect by a special case of it, and one of several segments by that of the whole
    line, unless that costs MIN_LOG_BAYES_FACTOR.

    What the general effect has besides is further physics, which needs as much evidence as any.
    """
    rig = workers.base.rig
    simpler = [_alike(best.hypothesis, candidates)]
    for k, member in enumerate(best.hypothesis):
        special = [c for c in candidates if is_limit(c, member, rig)]
        simpler.append(_exchanges(best.hypothesis, k, special))
    for hypotheses in simpler:
        jobs = [FitJob(h, NearFit(best)) for h in hypotheses]
        for fit in rank_by_evidence(workers.fit(jobs))[:1]:
            if fit.evidence > best.evidence - MIN_LOG_BAYES_FACTOR:
                return simplify_effects(workers, fit, candidates)
    return best


def _alike(hypothesis: Hypothesis, candidates: Sequence) -> list[Hypothesis]:
    """The hypotheses in which an effect of at least two segments is alike in all of the line."""
    found = []
    for effect, place in candidates:
        rest = tuple(m for m in hypothesis if m[0] is not effect)
        whole_line = effect.element == "segment" and place.element == "line"
        if whole_line and len(hypothesis) - len(rest) >= 2:
            found.append((*rest, (effect, place)))
    return found


def drop_needless_effects(workers: Workers, best: Fit) -> Fit:
    """Drop every effect whose evidence the other effects have taken over, the weakest first."""
    while len(best.hypothesis) > 1:
        fits = workers.fit(
            [job_without_effect(best, k, workers.base) for k in range(len(best.hypothesis))]
        )
        margins = [
            best.evidence - fit.evidence - min_log_bayes_factor(best.twin.rig, *member)
            for fit, member in zip(fits, best.hypothesis)
        ]
        weakest = int(np.argmin(margins))
        if margins[weakest] >= 0:
            break
        best = fits[weakest]
    return best


def refit_at_exact_mode(workers: Workers, best: Fit) -> Fit:
    """`best` at its exact mode.

    With nonlinear compliance a fit may stop short of its mode. An effect that is added then could
    gain evidence that belongs to the mode.
    """
    return _refit_nonlinear(workers, [best])[0]


def rank_at_exact_modes(workers: Workers, best: Fit, fits: list[Fit]) -> list[Fit]:
    """The extensions `fits` of `best`, best first, near-optimal ones refitted at their exact modes.

    The mode of the first effect with nonlinear compliance is narrow, and a fit that stops short of
    it may lose all of the effect's evidence. Poor fits are far from their modes: they take long and
    lose nothing by this.
    """
    if best.has_nonlinear_compliance:
        return fits
    near = [f for f in fits if f.model_error <= MAX_MODEL_ERROR_FOR_EXACT_MODE]
    far = [f for f in fits if f.model_error > MAX_MODEL_ERROR_FOR_EXACT_MODE]
    return rank_by_evidence([*_refit_nonlinear(workers, near), *far])


def _refit_nonlinear(workers: Workers, fits: Sequence[Fit]) -> list[Fit]:
    """The fits, those with nonlinear compliance refitted at their exact modes."""
    nonlinear = [f for f in fits if f.has_nonlinear_compliance]
    refits = {
        id(f): new for f, new in zip(nonlinear, workers.fit([job_from(f) for f in nonlinear]))
    }
    return [refits.get(id(f), f) for f in fits]
