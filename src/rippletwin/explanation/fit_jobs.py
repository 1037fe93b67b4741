"""Fits of many hypotheses to one set of observations, in several processes.

A `FitJob` says which hypothesis is fitted and how the fit starts: by continuation in frequency from
the nominal values, from a given theta, or near another fit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from multiprocessing import get_context

import numpy as np
from threadpoolctl import threadpool_limits

from rippletwin.calibration.fit import Fit, Hypothesis
from rippletwin.calibration.frequency_continuation import fit_hypothesis, refine
from rippletwin.calibration.posterior import Posterior
from rippletwin.calibration.score_test import ScoreTest
from rippletwin.case.model import Rig
from rippletwin.explanation.fit_starts import scan_starts, transfer_theta, weak_effect_starts
from rippletwin.twin.twin import Twin

POSITIONS_PER_WAVELENGTH = 8  # starts of a weak effect's position, on the shortest wavelength


@dataclass(frozen=True)
class Continuation:
    """Start from the nominal values at low frequencies and raise the frequency limit step by step.

    starts  coordinates of effect parameters by name, one mapping a start; empty for the scan of the
            newest effect (`scan_starts`)
    draws   number of random starts around each mode below a limit (see `fit_hypothesis`)
    """

    starts: tuple[Mapping[str, float], ...] = ()
    draws: int = 0

    def count_starts(self, rig, hypothesis: Hypothesis) -> int:
        """Number of starts, at most."""
        return len(self.starts or scan_starts(rig, hypothesis)) + self.draws

    def fit(self, base: Twin, hypothesis: Hypothesis, observations, source_free: bool) -> Fit:
        """Fit `hypothesis` by continuation in frequency."""
        starts = self.starts or scan_starts(base.rig, hypothesis)
        return fit_hypothesis(base, hypothesis, observations, starts, source_free, self.draws)


@dataclass(frozen=True, eq=False)
class FromTheta:
    """Start on all frequencies at `theta` (P,); with `exact` end at the exact mode, with `rough`
    after a few steps (`refine`)."""

    theta: np.ndarray
    exact: bool = True
    rough: bool = False

    def count_starts(self, rig, hypothesis: Hypothesis) -> int:
        """Number of starts: one."""
        return 1

    def fit(self, base: Twin, hypothesis: Hypothesis, observations, source_free: bool) -> Fit:
        """Fit `hypothesis` from `theta`."""
        return refine(
            base, hypothesis, observations, [self.theta], source_free, self.exact, rough=self.rough
        )


@dataclass(frozen=True, eq=False)
class NearFit:
    """Start on all frequencies at another `neighbour` fit, with the newest effect added.

    The newest effect starts from its scan and from small strengths at many positions. `thetas` are
    the starts that a score test has selected, if one was made (`score_extension`).
    """

    neighbour: Fit
    thetas: tuple[np.ndarray, ...] = ()

    def count_starts(self, rig, hypothesis: Hypothesis) -> int:
        """Number of starts in the effect's scan."""
        return len(scan_starts(rig, hypothesis))

    def fit(self, base: Twin, hypothesis: Hypothesis, observations, source_free: bool) -> Fit:
        """Fit `hypothesis` from the best of the starts near `neighbour`."""
        thetas = self.thetas or self.all_thetas(base, hypothesis, observations)
        return refine(base, hypothesis, observations, thetas, source_free, exact=False)

    def all_thetas(self, base: Twin, hypothesis: Hypothesis, observations) -> list[np.ndarray]:
        """All starts, each (P,), before a score test."""
        highest_hz = max(o.frequency_hz[-1] for o in observations)
        positions = int(np.ceil(POSITIONS_PER_WAVELENGTH * base.rig.delay * highest_hz))
        starts = scan_starts(base.rig, hypothesis)
        starts += [
            start
            for start in weak_effect_starts(base.rig, hypothesis, positions)
            if start not in starts
        ]
        index = base.with_(effects=hypothesis).index
        thetas = np.tile(transfer_theta(self.neighbour, hypothesis, base), (len(starts), 1))
        for theta, start in zip(thetas, starts):
            for name, u in start.items():
                theta[index[name]] = u
        return list(thetas)


@dataclass(frozen=True, eq=False)
class PlainCalibration:
    """Fit with the error model of `calibrate`, by continuation or from `theta` (P,) if given."""

    theta: np.ndarray | None = None

    def count_starts(self, rig, hypothesis: Hypothesis) -> int:
        """Number of starts: one."""
        return 1

    def fit(self, base: Twin, hypothesis: Hypothesis, observations, source_free: bool) -> Fit:
        """Fit `hypothesis`; a source that is known stays known."""
        if self.theta is None:
            return fit_hypothesis(base, hypothesis, observations, plain=True)
        return refine(base, hypothesis, observations, [self.theta], exact=False, plain=True)


@dataclass(frozen=True, eq=False)
class FitJob:
    """One fit.

    hypothesis    the effects of the twin, each at its place
    start         where the fit starts
    observations  indices of the observations that are fitted; None for all
    base          twin without effects that replaces that of the workers, as where the priors
                  differ; None for theirs
    source_free   whether the source's amplitude and phase are unknown at every frequency
    """

    hypothesis: Hypothesis
    start: Continuation | FromTheta | NearFit | PlainCalibration = Continuation()
    observations: tuple[int, ...] | None = None
    base: Twin | None = None
    source_free: bool = False


def run_fit_job(base: Twin, observations: Sequence, job: FitJob) -> Fit:
    """Run a job on the observations, with the twin `base` unless the job has one of its own."""
    base = base if job.base is None else job.base
    if job.observations is not None:
        observations = [observations[k] for k in job.observations]
        if base.changing_state:
            own = [o.label for o in observations if o.label in base.labels]
            base = base.with_(reference=own)
    return job.start.fit(base, job.hypothesis, observations, job.source_free)


def score_extension(base: Twin, observations: Sequence, job: FitJob) -> tuple[float, FitJob]:
    """What log evidence the newest effect of a job that starts near a fit promises, and the job
    with the starts that promise most (`ScoreTest`); for `Workers.map`."""
    posterior = Posterior(base.with_(effects=job.hypothesis), observations, None, job.source_free)
    assert isinstance(job.start, NearFit)
    thetas = job.start.all_thetas(base, job.hypothesis, observations)
    test = ScoreTest(base, posterior, thetas)
    return test.gain(), replace(job, start=replace(job.start, thetas=tuple(test.starts)))


def job_from(fit: Fit, exact: bool = True, **options) -> FitJob:
    """The job that repeats a fit from its mode; `options` are fields of `FitJob`."""
    theta = fit.twin.theta
    start = PlainCalibration(theta) if fit.plain else FromTheta(theta, exact)
    return FitJob(fit.hypothesis, start, **options)


def job_without_effect(fit: Fit, k: int, base: Twin) -> FitJob:
    """The job that refits without effect k, from the mode of `fit`."""
    rest = fit.without(k)
    return FitJob(rest, FromTheta(transfer_theta(fit, rest, base)))


def make_base(rig: Rig, observations: Sequence) -> Twin:
    """The twin without effects, not yet fitted, as explaining fits it to observations:
    the pump's numbers and the line's state in each recording are parameters."""
    return Twin(rig, observations, uncertain_pump=True, changing_state=True)


class Workers:
    """Run jobs on one base twin and one set of observations.

    `pool` is a process pool whose processes hold both (`open_workers`); None runs the jobs in this
    process.
    """

    def __init__(self, base: Twin, observations: Sequence, pool=None):
        self.base, self.observations = base, list(observations)
        self._pool = pool

    def fit(self, jobs: Sequence[FitJob], progress: Callable[[], None] | None = None) -> list[Fit]:
        """Fits in the order of `jobs`; `progress` is called after each.

        Jobs with the most starts run first, so that no process is left with a long job at the end.
        """
        rig = self.base.rig
        order = sorted(
            range(len(jobs)), key=lambda k: -jobs[k].start.count_starts(rig, jobs[k].hypothesis)
        )
        fits = self.map(run_fit_job, [jobs[k] for k in order], progress)
        return [fit for _, fit in sorted(zip(order, fits), key=lambda pair: pair[0])]

    def map(
        self, function: Callable, jobs: Sequence, progress: Callable[[], None] | None = None
    ) -> list:
        """function(base twin, observations, job) of every job, in the order of `jobs`."""
        calls = [(function, job) for job in jobs]
        if self._pool is None:
            _keep_data(self.base, self.observations)
            pending = map(_call, calls)
        else:
            pending = self._pool.map(_call, calls)
        results = []
        for result in pending:
            results.append(result)
            if progress is not None:
                progress()
        return results


@contextmanager
def open_workers(base: Twin, observations: Sequence, count: int) -> Iterator[Workers]:
    """`Workers` with `count` processes, which end with the context, also on an interrupt.

    Linear algebra gets one thread in each process: more threads than processor cores wait for each
    other.
    """
    with threadpool_limits(1):
        if count < 2:
            yield Workers(base, observations)
            return
        pool = ProcessPoolExecutor(
            count, get_context("fork"), initializer=_keep_data, initargs=(base, observations)
        )
        try:
            yield Workers(base, observations, pool)
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


_DATA: tuple = ()  # base twin and observations of a worker process


def _keep_data(base, observations):
    global _DATA
    _DATA = base, observations


def _call(call: tuple[Callable, object]):
    function, job = call
    return function(*_DATA, job)


def rank_by_evidence(fits: Sequence[Fit]) -> list[Fit]:
    """The fits whose evidence is finite, best first."""
    return sorted((f for f in fits if np.isfinite(f.evidence)), key=lambda f: -f.evidence)


def progress_callback(progress, task: str, total: int) -> Callable[[], None] | None:
    """A function that counts its calls and reports (task, done, total) to `progress`.

    None where `progress` is None.
    """
    if progress is None:
        return None
    done = 0

    def report():
        nonlocal done
        done += 1
        progress(task, done, total)

    return report
