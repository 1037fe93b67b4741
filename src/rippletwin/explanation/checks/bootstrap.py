"""Null distribution of the evidence by parametric bootstrap with refitting.

Recordings without an effect are drawn from the base fit, with sensor noise, model error and source
error as estimated. The line and every effect at every place are fitted to each draw. The largest
log Bayes factor of a draw is what an effect in the recording itself has to exceed (Efron and
Tibshirani 1993, An Introduction to the Bootstrap, sec. 16.4).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context

import numpy as np

from rippletwin.calibration.fit import Fit
from rippletwin.calibration.posterior import Posterior
from rippletwin.explanation.fit_jobs import Workers
from rippletwin.explanation.search.single_effects import fit_single_effects
from rippletwin.explanation.search.stepwise_search import applicable_candidates
from rippletwin.explanation.thresholds import FALSE_ALARM_RATE
from rippletwin.twin.reflection import stated_unit

MIN_DRAWS = 10  # fewer do not determine the tail of the distribution


@dataclass(frozen=True)
class NullDistribution:
    """Largest log Bayes factor (N,) of any effect in each draw without an effect."""

    log_bayes_factors: tuple[float, ...]

    @property
    def threshold(self) -> float:
        """Log Bayes factor that is exceeded in FALSE_ALARM_RATE of cases without an effect.

        The quantile of a fitted Gumbel distribution, or the largest of the draws if that is more.
        """
        from scipy.stats import gumbel_r  # takes half a second to import and is rarely needed

        shape = gumbel_r.fit(self.log_bayes_factors)
        quantile = float(gumbel_r.ppf(1.0 - FALSE_ALARM_RATE, *shape))
        return max(float(np.max(self.log_bayes_factors)), quantile)

    def p_value(self, log_bayes_factor: float) -> float:
        """Share of draws with at least this value, the recording itself counted as one of them."""
        exceeding = float(np.sum(np.asarray(self.log_bayes_factors) >= log_bayes_factor))
        return (1.0 + exceeding) / (1.0 + len(self.log_bayes_factors))


def bootstrap_null(
    base: Fit,
    observations: Sequence,
    draws: int,
    processes: int = 2,
    progress: Callable[[str, int, int], None] | None = None,
    seed: int = 0,
) -> NullDistribution:
    """Null distribution of `base`, the line without effects as fitted to `observations`.

    draws      recordings without an effect that are drawn
    processes  that fit them side by side
    progress   gets what is being fitted, how many draws are done and how many there are
    seed       of the random numbers; a draw has the same whatever the number of processes

    Raises ValueError for fewer than MIN_DRAWS draws.
    """
    check_draws(draws)
    jobs = [(base, tuple(observations), seed, k) for k in range(draws)]
    if processes < 2:
        values = tuple(_with_progress(map(_largest_log_bayes_factor, jobs), draws, progress))
        return NullDistribution(values)
    with ProcessPoolExecutor(processes, get_context("fork")) as pool:
        values = tuple(_with_progress(pool.map(_largest_log_bayes_factor, jobs), draws, progress))
    return NullDistribution(values)


def check_draws(draws: int) -> None:
    """Raises ValueError for fewer than MIN_DRAWS draws, but for none."""
    if draws and draws < MIN_DRAWS:
        raise ValueError(f"{draws} draws are too few for a threshold: at least {MIN_DRAWS}")


def draw_without_effects(fit: Fit, observations: Sequence, rng: np.random.Generator) -> list:
    """Observations drawn from the fitted twin and its error model."""
    posterior = Posterior(fit.twin, observations, None, fit.source_free)
    prediction = posterior.predict(fit.twin.theta)
    posterior.estimate_errors(prediction, fit.twin.theta)
    values = posterior.draw(prediction, rng)
    return [
        replace(o, values=_as_recorded(o, fit.twin.rig, values[:, part]))
        for o, part in zip(observations, posterior.forward.slices)
    ]


def _as_recorded(observation, rig, values: np.ndarray) -> np.ndarray:
    """Predicted values in the observed quantity: an impedance for a reflection coefficient."""
    if observation.kind != "input_impedance":
        return values
    unit = stated_unit(observation, rig)
    return unit * (1.0 + values) / (1.0 - values)


def _largest_log_bayes_factor(job: tuple[Fit, tuple, int, int]) -> float:
    base, observations, seed, k = job
    drawn = draw_without_effects(base, observations, np.random.default_rng([seed, k]))
    twin = base.twin.with_(theta=np.zeros_like(base.twin.theta))
    candidates = applicable_candidates(twin.rig, drawn)
    refitted_base, _, fits = fit_single_effects(Workers(twin, drawn), candidates)
    return max((fit.evidence - refitted_base.evidence for fit in fits), default=-np.inf)


def _with_progress(values: Iterable[float], draws: int, progress) -> Iterator[float]:
    for k, value in enumerate(values, 1):
        if progress is not None:
            progress("draws without an effect", k, draws)
        yield value
