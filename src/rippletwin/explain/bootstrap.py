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

from rippletwin.explain.fit import Fit
from rippletwin.explain.posterior import Posterior
from rippletwin.explain.search import library
from rippletwin.explain.singles import alone
from rippletwin.explain.workers import Workers
from rippletwin.forward import characteristic_impedance

ALARMS = 0.02  # of cases without an effect in which the threshold is passed
FEWEST = 10  # draws from which a tail is extrapolated


@dataclass(frozen=True)
class Chance:
    """Largest log evidence (N,) of any effect in each draw without one."""

    gains: tuple[float, ...]

    @property
    def threshold(self) -> float:
        """Log evidence that chance passes in ALARMS of cases: the quantile of a Gumbel distribution
        fitted to the draws' largest, or the largest of all where that is more."""
        from scipy.stats import gumbel_r  # half a second that few need

        shape = gumbel_r.fit(self.gains)
        return float(max(np.max(self.gains), gumbel_r.ppf(1.0 - ALARMS, *shape)))

    def p_value(self, gain: float) -> float:
        """Share of draws with as much, the recording itself counted among them."""
        return (1.0 + float(np.sum(np.asarray(self.gains) >= gain))) / (1.0 + len(self.gains))


def chance(
    base: Fit,
    observations: Sequence,
    draws: int,
    processes: int = 2,
    progress: Callable[[str, int, int], None] | None = None,
    seed: int = 0,
) -> Chance:
    """What chance makes of `base`, the line without effects as fitted to `observations`.

    Raises ValueError for fewer than FEWEST draws.
    """
    if draws < FEWEST:
        raise ValueError(f"{draws} draws: at least {FEWEST} are needed to tell a threshold")
    jobs = [(base, tuple(observations), seed, k) for k in range(draws)]
    if processes < 2:
        return Chance(tuple(_counted(map(_gain, jobs), draws, progress)))
    with ProcessPoolExecutor(processes, get_context("fork")) as pool:
        return Chance(tuple(_counted(pool.map(_gain, jobs), draws, progress)))


def without_effects(fit: Fit, observations: Sequence, rng: np.random.Generator) -> list:
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


def _gain(job) -> float:
    base, observations, seed, k = job
    drawn = without_effects(base, observations, np.random.default_rng([seed, k]))
    twin = base.twin.with_(theta=np.zeros_like(base.twin.theta))
    found, singles = alone(Workers(twin, drawn), library(twin.rig, drawn))
    return max((fit.evidence - found.evidence for fit in singles), default=-np.inf)


def _counted(gains, draws, progress):
    for k, gain in enumerate(gains, 1):
        if progress is not None:
            progress("draws without an effect", k, draws)
        yield gain
