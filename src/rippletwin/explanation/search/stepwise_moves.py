"""Steps from one explanation to the next: an effect more, another in its place, one less."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rippletwin.calibration.fit import Fit, Hypothesis
from rippletwin.calibration.posterior import MIN_MODEL_ERROR
from rippletwin.explanation.fit_jobs import (
    Workers,
    common_coordinates,
    job_without_effect,
    progress_callback,
    rank_by_evidence,
    scan_starts,
)
from rippletwin.explanation.thresholds import ACCEPT, GOOD, needed_of

MAX_EFFECTS = 4  # effects at a time
SUBSTITUTES_TRIED = 10  # single effects tried in the place of another
MAX_MODEL_ERROR_FOR_EXACT_MODE = (
    10.0 * MIN_MODEL_ERROR
)  # relative model error from which derivatives of storage lead to the mode
MIN_GAIN = 1.0  # log evidence by which what is put in the place of another, or elsewhere, is better
END_LIMITS = {"line_volume": (("load_volume", None), ("source_impedance", "volume"))}
"""Effects at any place, and what they are at the line's ends: name and form."""


def fit_extensions(pool: Workers, best: Fit, found: Sequence, progress) -> list[Fit]:
    """`best` with each of the candidates besides that it has not, best first; none beyond MOST."""
    if len(best.hypothesis) >= MAX_EFFECTS:
        return []
    rig = pool.base.rig
    jobs = [
        extension_job(best, candidate, rig)
        for candidate in found
        if candidate not in best.hypothesis
    ]
    tell = progress_callback(progress, f"{len(best.hypothesis) + 1} effects", len(jobs))
    fits = rank_by_evidence(pool.fit(jobs, tell))
    if fits and best.model_error > GOOD and fits[0].model_error > GOOD:
        # What is there may be right as it is, though far from all.
        near = pool.fit([{"hypothesis": f.hypothesis, "fit": best} for f in fits])
        fits = rank_by_evidence([max(pair, key=lambda f: f.evidence) for pair in zip(fits, near)])
    return rank_at_exact_modes(pool, best, fits)


def extension_job(best: Fit, candidate, rig) -> dict:
    """The job that adds a candidate to a fit.

    Where the fit is still poor its parameters are bent, and the fit starts from nominal again with
    its effects where they were; where it is good the candidate starts from it.
    """
    hypothesis = (*best.hypothesis, candidate)
    if best.model_error > GOOD:
        return restart_job(best, hypothesis, rig)
    return {"hypothesis": hypothesis, "fit": best}


def restart_job(best: Fit, hypothesis: Hypothesis, rig) -> dict:
    """The job that fits from nominal again, effects in common starting where they were."""
    kept = common_coordinates(best, hypothesis)
    return {
        "hypothesis": hypothesis,
        "starts": [{**kept, **start} for start in scan_starts(rig, hypothesis)],
    }


def exchange_effects(pool: Workers, best: Fit, singles: Sequence[Fit], rounds: int = 2) -> Fit:
    """Put another effect in the place of each while that is better and the fit still poor.

    The first effect taken in does the work of all that are missing; once others are there it may
    be the wrong one. What stands in is the best few single effects.
    """
    for _ in range(rounds):
        if len(best.hypothesis) < 2 or best.model_error <= GOOD:
            break
        stand_ins = [f.hypothesis[0] for f in singles[:SUBSTITUTES_TRIED]]
        jobs = []
        for k in range(len(best.hypothesis)):
            jobs += [
                restart_job(best, (*best.without(k), c), pool.base.rig)
                for c in stand_ins
                if c not in best.hypothesis
            ]
        better = rank_by_evidence(pool.fit(jobs))
        if not better or better[0].evidence < best.evidence + MIN_GAIN:
            break
        best = better[0]
    return best


def fit_substitutes(pool: Workers, best: Fit, found: Sequence) -> list[Fit]:
    """`best` with each of several effects exchanged for every other on the same element, and for
    itself anywhere else, best first: those that might be taken for it were never tried beside what
    was taken in after it, or from a line still far off. What no line is without is known to be
    there."""
    members = best.hypothesis if len(best.hypothesis) > 1 else ()
    jobs = [
        {"hypothesis": (*best.without(k), candidate), "fit": best}
        for k, (effect, place) in enumerate(members)
        for candidate in found
        if candidate[1].element == place.element or candidate[0].name == effect.name
        if candidate not in best.hypothesis and not effect.certain
    ]
    return rank_by_evidence(pool.fit(jobs))


def simplify_effects(pool: Workers, best: Fit, found: Sequence) -> Fit:
    """Put in the place of each effect one that it contains, unless that costs ACCEPT.

    What the larger has besides is physics of its own, which has to be worth as much as any other.
    """
    for k, member in enumerate(best.hypothesis):
        rest = best.without(k)
        jobs = [
            {"hypothesis": (*rest, c), "fit": best}
            for c in found
            if c not in rest and _contains(member, c, pool.base.rig)
        ]
        for fit in rank_by_evidence(pool.fit(jobs))[:1]:
            if fit.evidence > best.evidence - ACCEPT:
                return simplify_effects(pool, fit, found)
    return best


def _contains(member, other, rig) -> bool:
    """Whether an effect is a special case of another: of its equations, or where it may be."""
    (effect, place), (less, where) = member, other
    if effect is not less:
        return (less.name, where.form) in END_LIMITS.get(effect.name, ())
    names = [{p.name for p in e.parameters(rig, at)} for e, at in (member, other)]
    return place.element == where.element and names[1] < names[0]


def drop_needless_effects(pool: Workers, best: Fit) -> Fit:
    """Drop every effect that the others have made needless."""
    while len(best.hypothesis) > 1:
        fits = pool.fit(
            [job_without_effect(best, k, pool.base) for k in range(len(best.hypothesis))]
        )
        losses = [
            best.evidence - fit.evidence - needed_of(effect)
            for fit, (effect, _) in zip(fits, best.hypothesis)
        ]
        weakest = int(np.argmin(losses))
        if losses[weakest] >= 0:
            break
        best = fits[weakest]
    return best


def refit_at_exact_mode(pool: Workers, best: Fit) -> Fit:
    """The fit at its exact mode, where that takes derivatives of what the line stores: what is
    added to a fit that stopped short of it would be taken for what is missing."""
    return _exact(pool, [best])[0]


def rank_at_exact_modes(pool: Workers, best: Fit, step: list[Fit]) -> list[Fit]:
    """A step's fits as they can be held against each other, best first: where the newest effect is
    the first that stores something, its mode is narrow, and a fit that stopped short of it may have
    lost all that the effect is worth. Far from the mode, where that takes long, nothing is lost."""
    if best.has_nonlinear_compliance:
        return step
    near = [f for f in step if f.model_error <= MAX_MODEL_ERROR_FOR_EXACT_MODE]
    return rank_by_evidence(
        [*_exact(pool, near), *(f for f in step if f.model_error > MAX_MODEL_ERROR_FOR_EXACT_MODE)]
    )


def _exact(pool: Workers, fits: Sequence[Fit]) -> list[Fit]:
    """The fits, at their exact mode those of lines that store beyond proportion."""
    storing = [f for f in fits if f.has_nonlinear_compliance]
    again = pool.fit([{"hypothesis": f.hypothesis, "theta": f.twin.theta} for f in storing])
    better = {id(f): new for f, new in zip(storing, again)}
    return [better.get(id(f), f) for f in fits]
