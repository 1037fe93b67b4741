"""First step of the search: the line without effects, the usual effects, and each other one alone.

Boundary layers and creep of the walls are in nearly every real line, and so are the chambers of a
pump whose flow is stated. A line without them fits so badly that nothing else can be judged. So
they are tried first, and the other effects beside those that the data show.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from rippletwin.calibration.fit import Fit
from rippletwin.errors import InputError
from rippletwin.explanation.fit_jobs import (
    Continuation,
    FitJob,
    FromTheta,
    NearFit,
    Workers,
    progress_callback,
    rank_by_evidence,
)
from rippletwin.explanation.fit_starts import transfer_theta
from rippletwin.explanation.search.stepwise_moves import (
    WRONG_MODE_MODEL_ERROR,
    fit_extensions,
    rank_at_exact_modes,
)
from rippletwin.explanation.thresholds import (
    GOOD_MODEL_ERROR,
    MIN_LOG_BAYES_FACTOR,
    surplus_evidence,
)

DRAWS_PER_MODE = 800  # random starts around each mode below a frequency limit
BASE_RESTARTS = 5  # best single-effect fits from whose lines the base is refitted
POOR_FITS_REFITTED = 3  # of the best single-effect fits


def fit_single_effects(
    workers: Workers, candidates: Sequence, progress=None
) -> tuple[Fit, Fit, list[Fit]]:
    """The base, the fit with the usual effects that the data show, and the fits of each other of
    `candidates` beside these, best first.

    The second is the base where the data show none; the fits then are of each effect alone. Raises
    InputError where no fit finds a steady state of the line.
    """
    usual = [c for c in candidates if c[0].usual(workers.base.rig, c[1])]
    jobs = [FitJob(()), *(FitJob((c,)) for c in usual)]
    base, *fits = workers.fit(jobs, progress_callback(progress, "usual effects", len(jobs)))
    if not any(np.isfinite(fit.evidence) for fit in (base, *fits)):
        raise InputError(
            "rig.yaml",
            "load_pressure, flow_ripple",
            "no steady state of the line was found, whatever its numbers are",
            "Correct load_pressure, flow_ripple or load.coefficient",
        )
    start = _add_usual_effects(workers, base, fits)
    if not start.hypothesis:
        base, fits = _fit_each_alone(workers, base, fits, candidates, progress)
        return base, base, fits
    base = _best_restart(workers, base, [start])
    others = [c for c in candidates if c not in start.hypothesis]
    extensions = fit_extensions(workers, start, others, progress)
    return base, start, rank_by_evidence([start, *extensions])


def _add_usual_effects(workers: Workers, base: Fit, fits: Sequence[Fit]) -> Fit:
    """`base` with the set of usual effects that adds most evidence beyond what each must add, where
    the set adds enough; `fits` are those of one each.

    All sets are tried: friction and creep both damp, so that the first alone may do for both.
    """
    found = {frozenset(f.hypothesis): f for f in fits}
    usual = [f.hypothesis[0] for f in fits]
    for size in range(2, len(usual) + 1):
        jobs = []
        for members in combinations(usual, size):
            parts = [found[frozenset(members) - {c}] for c in members]
            near = max(parts, key=lambda f: f.evidence)
            (newest,) = set(members) - set(near.hypothesis)
            jobs.append(FitJob((*near.hypothesis, newest), NearFit(near)))
        found |= {frozenset(f.hypothesis): f for f in workers.fit(jobs)}
    best = max(found.values(), key=surplus_evidence, default=base)
    return best if best.evidence >= base.evidence + MIN_LOG_BAYES_FACTOR else base


def _fit_each_alone(
    workers: Workers, base: Fit, known: Sequence[Fit], candidates: Sequence, progress
) -> tuple[Fit, list[Fit]]:
    """The base, and the fits of each of `candidates` alone, best first; `known` are some."""
    fitted = {f.hypothesis[0] for f in known}
    rest = [c for c in candidates if c not in fitted]
    report = progress_callback(progress, "single effects", len(rest))
    fits = [*known, *workers.fit([FitJob((c,)) for c in rest], report)]
    base = _refit_base(workers, base, fits)
    if (
        base.model_error <= GOOD_MODEL_ERROR
        or rank_by_evidence(fits)[0].model_error > GOOD_MODEL_ERROR
    ):
        # If the base fits well, an effect can only be weak, and its mode lies near the base. If no
        # effect fits well, the line of the base may still be right.
        report = progress_callback(progress, "weak effects", len(candidates))
        near = workers.fit([FitJob(f.hypothesis, NearFit(base)) for f in fits], report)
        fits = [max(pair, key=lambda f: f.evidence) for pair in zip(fits, near)]
    fits = refit_poor_fits(workers, rank_by_evidence(fits))
    return base, rank_at_exact_modes(workers, base, fits)


def _refit_base(workers: Workers, base: Fit, fits: Sequence[Fit]) -> Fit:
    """The best of `base` and its refits from other starts.

    If the base fit is stuck in a wrong local mode, the first effect that escapes it gets credit for
    the whole improvement. The other starts are the lines of the best single-effect fits. With one
    operating point, whose lowest harmonics say least, they are also random draws around the modes
    below each frequency limit.
    """
    jobs = []
    if base.model_error > WRONG_MODE_MODEL_ERROR and len(workers.observations) == 1:
        jobs = [FitJob((), Continuation(draws=DRAWS_PER_MODE))]
    return _best_restart(workers, base, rank_by_evidence(fits)[:BASE_RESTARTS], jobs)


def _best_restart(workers: Workers, base: Fit, fits: Sequence[Fit], jobs: Sequence = ()) -> Fit:
    """The best of `base`, its refits from the lines of `fits`, and the fits of further `jobs`."""
    from_lines = [
        FitJob((), FromTheta(transfer_theta(fit, (), workers.base), exact=False)) for fit in fits
    ]
    return max([base, *workers.fit([*jobs, *from_lines])], key=lambda fit: fit.evidence)


def refit_poor_fits(workers: Workers, fits: list[Fit]) -> list[Fit]:
    """`fits` with the poor ones among the best refitted from more starts, best first.

    A poor fit may be stuck in a wrong local mode. With one operating point an effect along the
    whole line also starts from random draws: it is as free as the line itself.
    """
    poor = [
        f
        for f in fits[:POOR_FITS_REFITTED]
        if f.model_error > WRONG_MODE_MODEL_ERROR and f.hypothesis
    ]
    jobs = []
    for fit in poor:
        whole_line = fit.hypothesis[-1][1].element == "line"
        draws = DRAWS_PER_MODE if whole_line and len(workers.observations) == 1 else 0
        starts = tuple(refined_starts(workers.base.rig, fit))
        jobs.append(FitJob(fit.hypothesis, Continuation(starts, draws)))
    refits = {id(old): new for old, new in zip(poor, workers.fit(jobs))}
    return rank_by_evidence([max(f, refits.get(id(f), f), key=lambda x: x.evidence) for f in fits])


def refined_starts(rig, fit: Fit) -> list[dict[str, float]]:
    """Starts on a finer grid over the scan of the newest effect, the rest of it as fitted.

    For an effect without a scan, its fitted coordinates and the nominal ones.
    """
    effect, place = fit.hypothesis[-1]
    label = f"{effect.name}@{place}"
    fitted = {
        p.name: float(fit.twin.theta[fit.twin.index[f"{label}.{p.name}"]])
        for p in effect.parameters(rig, place)
    }
    starts = []
    for p in effect.parameters(rig, place):
        if len(p.scan) > 1:
            low, high = min(p.scan), max(p.scan)
            for u in np.linspace(1.3 * low, 1.3 * high, 2 * len(p.scan)):
                start = {**fitted, p.name: float(u)}
                starts.append({f"{label}.{name}": value for name, value in start.items()})
    return starts or [{f"{label}.{name}": value for name, value in fitted.items()}, {}]
