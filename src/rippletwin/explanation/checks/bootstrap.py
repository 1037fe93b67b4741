"""How much evidence chance gives an effect: the threshold by parametric bootstrap.

Recordings that the line alone might have given are drawn from its fit: sensor noise, model error
and errors of the source, all as large as they were estimated. To each the line is fitted again, and
every effect of the library at every place it can be. The largest log evidence that any effect adds
is what the one found in the recording itself has to beat (Efron & Tibshirani 1993, An Introduction
to the Bootstrap, sec. 16.4, with refitting).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context

import numpy as np

from rippletwin.calibration.fit import Fit
from rippletwin.calibration.posterior import Posterior
from rippletwin.explanation.fit_jobs import Workers
from rippletwin.explanation.search.single_effects import fit_single_effects
from rippletwin.explanation.search.stepwise_search import applicable_candidates
from rippletwin.twin.forward_model import characteristic_impedance

FALSE_ALARM_RATE = 0.02  # of cases without an effect in which the threshold is passed
MIN_DRAWS = 10  # draws from which a tail is extrapolated


@dataclass(frozen=True)
class NullDistribution:
    """Largest log evidence (N,) of any effect in each draw without one."""

    gains: tuple[float, ...]

    @property
    def threshold(self) -> float:
        """Log evidence that chance passes in ALARMS of cases: the quantile of a Gumbel distribution
        fitted to the draws' largest, or the largest of all where that is more."""
        from scipy.stats import gumbel_r  # half a second that few need

        shape = gumbel_r.fit(self.gains)
        return float(max(np.max(self.gains), gumbel_r.ppf(1.0 - FALSE_ALARM_RATE, *shape)))

    def p_value(self, gain: float) -> float:
        """Share of draws with as much, the recording itself counted among them."""
        return (1.0 + float(np.sum(np.asarray(self.gains) >= gain))) / (1.0 + len(self.gains))


def bootstrap_null(
    base: Fit,
    observations: Sequence,
    draws: int,
    processes: int = 2,
    progress: Callable[[str, int, int], None] | None = None,
    seed: int = 0,
) -> NullDistribution:
    """What chance makes of `base`, the line without effects as fitted to `observations`.

    Raises ValueError for fewer than FEWEST draws.
    """
    if draws < MIN_DRAWS:
        raise ValueError(f"{draws} draws: at least {MIN_DRAWS} are needed to tell a threshold")
    jobs = [(base, tuple(observations), seed, k) for k in range(draws)]
    if processes < 2:
        return NullDistribution(tuple(_with_progress(map(_largest_gain, jobs), draws, progress)))
    with ProcessPoolExecutor(processes, get_context("fork")) as pool:
        return NullDistribution(
            tuple(_with_progress(pool.map(_largest_gain, jobs), draws, progress))
        )


def draw_without_effects(fit: Fit, observations: Sequence, rng: np.random.Generator) -> list:
    """Observations that the fitted twin might have given, drawn anew."""
    posterior = Posterior(fit.twin, observations, None, fit.source_free)
    prediction = posterior.predict(fit.twin.theta)
    posterior.estimate_errors(prediction, fit.twin.theta)
    values = posterior.draw(prediction, rng)
    return [
        replace(o, values=_as_recorded(o, fit.twin.rig, values[:, part]))
        for o, part in zip(observations, posterior.forward.slices)
    ]


def _as_recorded(observation, rig, values: np.ndarray) -> np.ndarray:
    """A prediction in the quantity that was observed: of a reflection the impedance."""
    if observation.kind != "input_impedance":
        return values
    unit = 1.0 if observation.normalised else characteristic_impedance(rig.fluid, rig.line[0])
    return unit * (1.0 + values) / (1.0 - values)


def _largest_gain(job) -> float:
    base, observations, seed, k = job
    drawn = draw_without_effects(base, observations, np.random.default_rng([seed, k]))
    twin = base.twin.with_(theta=np.zeros_like(base.twin.theta))
    found, singles = fit_single_effects(
        Workers(twin, drawn), applicable_candidates(twin.rig, drawn)
    )
    return max((fit.evidence - found.evidence for fit in singles), default=-np.inf)


def _with_progress(gains, draws, progress):
    for k, gain in enumerate(gains, 1):
        if progress is not None:
            progress("draws without an effect", k, draws)
        yield gain
