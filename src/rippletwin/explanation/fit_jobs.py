"""Fits of many hypotheses to one set of data, in processes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from itertools import product
from multiprocessing import get_context

import numpy as np
from threadpoolctl import threadpool_limits

from rippletwin.calibration.fit import Fit, Hypothesis
from rippletwin.calibration.frequency_continuation import fit_hypothesis, refine
from rippletwin.twin.twin import Twin

WEAK_COORDINATE = -2.0  # of a weak effect's parameters, in prior standard deviations
PLACES_PER_WAVE = 8  # on the shortest wave


def scan_starts(rig, hypothesis: Hypothesis) -> list[dict[str, float]]:
    """Starts for the newest effect of a hypothesis: all combinations of its parameters' scans."""
    return _combined(rig, hypothesis, lambda parameter: parameter.scan)


def weak_effect_starts(rig, hypothesis: Hypothesis, places: int) -> list[dict[str, float]]:
    """Starts for the newest effect where it does little: positive parameters that have no scan of
    their own at WEAK, and as many `places` along the line, about a good fit the valleys are narrow.
    """

    def coordinates(parameter):
        prior = parameter.prior
        if prior.kind == "lognormal" and len(parameter.scan) == 1:
            return (WEAK_COORDINATE,)
        if parameter.name == "position":
            share = (np.arange(places) + 0.5) / places
            return tuple(prior.coordinate(prior.centre + prior.scale * share))
        return parameter.scan

    return _combined(rig, hypothesis, coordinates)


def _combined(rig, hypothesis: Hypothesis, coordinates: Callable) -> list[dict[str, float]]:
    if not hypothesis:
        return [{}]
    effect, place = hypothesis[-1]
    parameters = effect.parameters(rig, place)
    names = [f"{effect.name}@{place}.{p.name}" for p in parameters]
    return [dict(zip(names, us)) for us in product(*map(coordinates, parameters))]


def transfer_theta(fit: Fit, hypothesis: Hypothesis, base: Twin) -> np.ndarray:
    """theta of a twin with another hypothesis, parameters in common where `fit` has them."""
    twin = base.with_(effects=hypothesis)
    return np.array(
        [
            fit.twin.theta[fit.twin.index[p.name]] if p.name in fit.twin.index else 0.0
            for p in twin.parameters
        ]
    )


def common_coordinates(fit: Fit, hypothesis: Hypothesis) -> dict[str, float]:
    """Coordinates by name, as fitted, of the effects that another hypothesis has too."""
    names = {f"{effect.name}@{place}" for effect, place in hypothesis}
    index, theta = fit.twin.index, fit.twin.theta
    return {name: float(theta[k]) for name, k in index.items() if name.split(".")[0] in names}


def job_without_effect(fit: Fit, k: int, base: Twin) -> dict:
    """The job that fits again without effect k, from where the fit is."""
    rest = fit.without(k)
    return {"hypothesis": rest, "theta": transfer_theta(fit, rest, base)}


class Workers:
    """Fits hypotheses to one set of data, in `pool` or, where that is None, in this process."""

    def __init__(self, base: Twin, observations: Sequence, pool=None):
        self.base, self.observations = base, list(observations)
        self._pool = pool

    def fit(self, jobs: Sequence[dict], progress: Callable[[], None] | None = None) -> list[Fit]:
        """Fits in the order of `jobs`, each a hypothesis and options of `work`.

        Those of most starts are begun first, so that no process ends long after the others.
        """
        first = sorted(range(len(jobs)), key=lambda k: -self._starts(jobs[k]))
        fits = self.map(run_fit_job, [jobs[k] for k in first], progress)
        return [fit for _, fit in sorted(zip(first, fits), key=lambda pair: pair[0])]

    def _starts(self, job: dict) -> int:
        """How many a fit sets out from, at most."""
        if "theta" in job:
            return 1
        starts = job.get("starts") or scan_starts(self.base.rig, job["hypothesis"])
        return len(starts) + job.get("draws", 0)

    def map(
        self,
        function: Callable,
        jobs: Sequence[dict],
        progress: Callable[[], None] | None = None,
    ) -> list:
        """function(base twin, observations, job) of every job, in their order."""
        calls = [(function, job) for job in jobs]
        if self._pool is None:
            _prepare(self.base, self.observations)
            results = map(_call, calls)
        else:
            results = self._pool.map(_call, calls)
        found = []
        for result in results:
            found.append(result)
            if progress is not None:
                progress()
        return found


@contextmanager
def open_workers(base: Twin, observations: Sequence, count: int) -> Iterator[Workers]:
    """`Workers` with `count` processes; an interrupt ends them.

    Linear algebra gets one thread in each: more of them wait for each other where the processes
    already fill the machine.
    """
    with threadpool_limits(1):
        if count < 2:
            yield Workers(base, observations)
            return
        pool = ProcessPoolExecutor(
            count, get_context("fork"), initializer=_prepare, initargs=(base, observations)
        )
        try:
            yield Workers(base, observations, pool)
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


_DATA: tuple = ()  # of a worker process: base twin and observations


def _prepare(base, observations):
    global _DATA
    _DATA = base, observations


def _call(call: tuple[Callable, dict]):
    function, job = call
    return function(*_DATA, job)


def run_fit_job(base: Twin, observations: Sequence, job: dict) -> Fit:
    """Fit `hypothesis` to the observations with the indices `use` (all by default).

    The job's `base` takes the place of the twin, as where the sheet is another. With `theta` from
    there, `exact` as in `refine`; with `fit` from where that ended and the newest effect's starts,
    as strong as its prior and weak; else by continuation from the starts `starts` or the newest
    effect's scan; `source_free` and `draws` as in `fit_hypothesis`.
    """
    base = job.get("base", base)
    use = job.get("use")
    observations = observations if use is None else [observations[k] for k in use]
    hypothesis, free = job["hypothesis"], job.get("source_free", False)
    if "theta" in job:
        return refine(base, hypothesis, observations, [job["theta"]], free, job.get("exact", True))
    if "fit" in job:
        twin, thetas = base.with_(effects=hypothesis), []
        places = int(
            np.ceil(
                PLACES_PER_WAVE * base.rig.delay * max(o.frequency_hz[-1] for o in observations)
            )
        )
        starts = scan_starts(base.rig, hypothesis)
        starts += [u for u in weak_effect_starts(base.rig, hypothesis, places) if u not in starts]
        for start in starts:
            theta = transfer_theta(job["fit"], hypothesis, base)
            for name, u in start.items():
                theta[twin.index[name]] = u
            thetas.append(theta)
        return refine(base, hypothesis, observations, thetas, free, exact=False)
    starts = job.get("starts") or scan_starts(base.rig, hypothesis)
    return fit_hypothesis(base, hypothesis, observations, starts, free, job.get("draws", 0))


def rank_by_evidence(fits: Sequence[Fit]) -> list[Fit]:
    """Fits with an evidence, best first."""
    return sorted((f for f in fits if np.isfinite(f.evidence)), key=lambda f: -f.evidence)


def progress_callback(progress, what: str, total: int) -> Callable[[], None] | None:
    """What tells `progress` (what, done, total) at every call; None where nobody asks."""
    if progress is None:
        return None
    done = 0

    def tell():
        nonlocal done
        done += 1
        progress(what, done, total)

    return tell
