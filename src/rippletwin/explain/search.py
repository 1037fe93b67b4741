"""Search over hypotheses: every effect at every place, then pairs and triples, by evidence."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from itertools import product
from multiprocessing import get_context

from rippletwin.effects import Effect, Place, candidates
from rippletwin.explain.fit import Fit, Hypothesis, fit_hypothesis
from rippletwin.twin import Twin


def scan(rig, hypothesis: Hypothesis) -> list[dict[str, float]]:
    """Starts for the newest effect of a hypothesis: all combinations of its parameters' scans."""
    if not hypothesis:
        return [{}]
    effect, place = hypothesis[-1]
    parameters = effect.parameters(rig, place)
    names = [f"{effect.name}@{place}.{p.name}" for p in parameters]
    return [dict(zip(names, us)) for us in product(*(p.scan for p in parameters))]


@dataclass
class Workers:
    """Processes that fit hypotheses to one set of data; use it as a context.

    With `count` 1 everything runs in this process.
    """

    base: Twin
    observations: Sequence
    count: int = 2

    def __enter__(self):
        self._pool = None
        if self.count > 1:
            self._pool = ProcessPoolExecutor(
                self.count,
                get_context("fork"),
                initializer=_prepare,
                initargs=(self.base, self.observations),
            )
        return self

    def __exit__(self, *error):
        if self._pool is not None:
            self._pool.shutdown(wait=True, cancel_futures=True)

    def fit(self, jobs: Sequence[dict], progress: Callable[[], None] | None = None) -> list[Fit]:
        """Fits in the order of `jobs`: keyword arguments of `fit_hypothesis`, less twin and data.

        A job may carry `observations`, indices of those to use.
        """
        if self._pool is None:
            _prepare(self.base, self.observations)
            results = map(_work, jobs)
        else:
            results = self._pool.map(_work, jobs)
        fits = []
        for fit in results:
            fits.append(fit)
            if progress is not None:
                progress()
        return fits


_DATA: tuple = ()


def _prepare(base, observations):
    global _DATA
    _DATA = base, observations


def _work(job):
    base, observations = _DATA
    job = dict(job)
    chosen = job.pop("observations", None)
    if chosen is not None:
        observations = [observations[k] for k in chosen]
    hypothesis = job.pop("hypothesis")
    starts = job.pop("starts", None) or scan(base.rig, hypothesis)
    return fit_hypothesis(base, hypothesis, observations, starts, **job)


def library(rig, observations: Sequence) -> list[tuple[Effect, Place]]:
    """The candidates that these data can say anything about."""
    kinds = {o.kind for o in observations}
    found = []
    for effect, place in candidates(rig):
        if kinds == {"input_impedance"} and effect.element in ("source", "sensor"):
            continue
        if effect.name == "entrained_air" and "periodic" not in kinds:
            continue
        found.append((effect, place))
    return found
