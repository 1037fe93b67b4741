"""The line without any effect, and every effect at every place alone."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rippletwin.calibration.fit import Fit
from rippletwin.explanation.fit_jobs import (
    Workers,
    progress_callback,
    rank_by_evidence,
    transfer_theta,
)
from rippletwin.explanation.search.stepwise_moves import rank_at_exact_modes
from rippletwin.explanation.thresholds import GOOD

DRAWS_PER_MODE = 800  # about each fit below a limit
BASE_RESTARTS = 5  # single effects from whose lines the base is fitted again


def fit_single_effects(pool: Workers, found: Sequence, progress=None) -> tuple[Fit, list[Fit]]:
    """The base, and each of the candidates `found` alone, best first."""
    tell = progress_callback(progress, "single effects", len(found) + 1)
    fits = pool.fit([{"hypothesis": h} for h in [(), *((c,) for c in found)]], tell)
    base, singles = _refit_base(pool, fits[0], fits[1:]), fits[1:]
    if base.model_error <= GOOD or rank_by_evidence(singles)[0].model_error > GOOD:
        # A line that fits without the effect has no other valley for it than a weak one nearby;
        # and where no effect fits, that line may be the right one all the same.
        tell = progress_callback(progress, "weak effects", len(found))
        near = pool.fit([{"hypothesis": f.hypothesis, "fit": base} for f in singles], tell)
        singles = [max(pair, key=lambda f: f.evidence) for pair in zip(singles, near)]
    return base, rank_at_exact_modes(pool, base, refit_poor_fits(pool, rank_by_evidence(singles)))


def _refit_base(pool: Workers, base: Fit, singles: Sequence[Fit]) -> Fit:
    """The base, or what it becomes from where the best effects have brought the line, or from
    draws about what lower harmonics leave possible.

    A base that stopped in a wrong valley, as from a sheet that is far off, would give all of the
    way out of it to whichever effect first finds out.
    """
    starts = rank_by_evidence(singles)[:BASE_RESTARTS]
    jobs = [{"hypothesis": (), "theta": transfer_theta(fit, (), pool.base)} for fit in starts]
    if base.model_error > GOOD and len(pool.observations) == 1:
        # Of one operating point the lowest harmonics say least.
        jobs = [{"hypothesis": (), "draws": DRAWS_PER_MODE}, *jobs]
    return max([base, *pool.fit(jobs)], key=lambda fit: fit.evidence)


def refit_poor_fits(pool: Workers, fits: list[Fit], count: int = 3) -> list[Fit]:
    """Fits again, from more starts, those of the best that may have stopped in a wrong valley; of
    one operating point, what acts along the whole line from draws too, as the base.
    """
    again = [f for f in fits[:count] if f.model_error > GOOD and f.hypothesis]
    jobs = [{"hypothesis": f.hypothesis, "starts": refined_starts(pool.base.rig, f)} for f in again]
    if len(pool.observations) == 1:
        for job in jobs:
            # Along the whole line an effect is as free as the line itself.
            if job["hypothesis"][-1][0].element == "line":
                job["draws"] = DRAWS_PER_MODE
    better = {id(f): new for f, new in zip(again, pool.fit(jobs))}
    return rank_by_evidence([max(f, better.get(id(f), f), key=lambda x: x.evidence) for f in fits])


def refined_starts(rig, fit: Fit) -> list[dict[str, float]]:
    """Starts about where a fit ended, and a finer grid over what its effect scans."""
    effect, place = fit.hypothesis[-1]
    label = f"{effect.name}@{place}"
    own = {
        p.name: float(fit.twin.theta[fit.twin.index[f"{label}.{p.name}"]])
        for p in effect.parameters(rig, place)
    }
    starts = []
    for p in effect.parameters(rig, place):
        if len(p.scan) > 1:
            low, high = min(p.scan), max(p.scan)
            for u in np.linspace(1.3 * low, 1.3 * high, 2 * len(p.scan)):
                starts.append({f"{label}.{n}": v for n, v in {**own, p.name: float(u)}.items()})
    return starts or [{f"{label}.{n}": v for n, v in own.items()}, {}]
