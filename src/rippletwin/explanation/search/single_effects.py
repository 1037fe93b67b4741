"""First step of the search: the line without effects, and every effect at every place alone."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rippletwin.calibration.fit import Fit
from rippletwin.explanation.fit_jobs import (
    Continuation,
    FitJob,
    FromTheta,
    NearFit,
    Workers,
    progress_callback,
    rank_by_evidence,
    transfer_theta,
)
from rippletwin.explanation.search.stepwise_moves import rank_at_exact_modes
from rippletwin.explanation.thresholds import GOOD_MODEL_ERROR

DRAWS_PER_MODE = 800  # random starts around each mode below a frequency limit
BASE_RESTARTS = 5  # best single-effect fits from whose lines the base is refitted
POOR_FITS_REFITTED = 3  # of the best single-effect fits


def fit_single_effects(
    workers: Workers, candidates: Sequence, progress=None
) -> tuple[Fit, list[Fit]]:
    """The base, and the fits of each of `candidates` alone, best first."""
    report = progress_callback(progress, "single effects", len(candidates) + 1)
    base, *fits = workers.fit([FitJob(()), *(FitJob((c,)) for c in candidates)], report)
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
    jobs = [
        FitJob((), FromTheta(transfer_theta(fit, (), workers.base)))
        for fit in rank_by_evidence(fits)[:BASE_RESTARTS]
    ]
    if base.model_error > GOOD_MODEL_ERROR and len(workers.observations) == 1:
        jobs = [FitJob((), Continuation(draws=DRAWS_PER_MODE)), *jobs]
    return max([base, *workers.fit(jobs)], key=lambda fit: fit.evidence)


def refit_poor_fits(workers: Workers, fits: list[Fit]) -> list[Fit]:
    """`fits` with the poor ones among the best refitted from more starts, best first.

    A poor fit may be stuck in a wrong local mode. With one operating point an effect along the
    whole line also starts from random draws: it is as free as the line itself.
    """
    poor = [
        f for f in fits[:POOR_FITS_REFITTED] if f.model_error > GOOD_MODEL_ERROR and f.hypothesis
    ]
    jobs = []
    for fit in poor:
        whole_line = fit.hypothesis[-1][0].element == "line"
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
