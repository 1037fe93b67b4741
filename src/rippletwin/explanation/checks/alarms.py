"""Alarms: does the line without effects fail to explain the data?

Refitted parameters absorb what is missing, so a good fit proves nothing. Four alarms look at the
base fit: what a free correction of one element would add to it, the pull of the parameters away
from the data sheet (where an absorbed effect shows), the disagreement between fits of single
operating points, and drift within a recording. The verdict rests on the support of the effects; the
alarms decide where no effect is accepted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from rippletwin.calibration.fit import Fit
from rippletwin.explanation.fit_jobs import FitJob, FromTheta, Workers
from rippletwin.explanation.localise.elements import NONE, elements_of
from rippletwin.explanation.localise.smooth_corrections import SmoothCorrections
from rippletwin.explanation.thresholds import (
    DISAGREEMENT_ALARM,
    DRIFT_SIGNIFICANCE,
    LITTLE_MODEL_ERROR,
    MIN_LOG_BAYES_FACTOR,
    PULL_ALARM,
)
from rippletwin.spectra.frequency_selection import select_frequencies

RESONANCE_PASSAGES = 100.0
"""Passages of the line that a wave makes in a sharp resonance; another speed changes its phase."""
HALVES_MODEL_ERROR = 0.5 * LITTLE_MODEL_ERROR  # relative, between the two halves of a recording


@dataclass(frozen=True)
class Alarms:
    """What each alarm measures, and whether it is raised.

    misfit         log Bayes factor of the best free correction of one element of the line
                   (`localise.smooth_corrections`)
    pull           largest |coordinate| of a parameter with a prior, and the parameter's name
    disagreement   largest difference between operating points in standard deviations, and the
                   parameter's name
    drift          p-value that both halves of a recording are of one state, and its label
    """

    misfit: float
    pull: tuple[float, str]
    disagreement: tuple[float, str]
    drift: tuple[float, str]

    @property
    def raised(self) -> tuple[str, ...]:
        """Names of the alarms that are raised."""
        states = {
            "misfit": self.misfit >= MIN_LOG_BAYES_FACTOR,
            "pull": self.pull[0] > PULL_ALARM,
            "disagreement": self.disagreement[0] > DISAGREEMENT_ALARM,
            "drift": self.drift[0] < DRIFT_SIGNIFICANCE,
        }
        return tuple(name for name, state in states.items() if state)


def read_alarms(
    base: Fit,
    observations: Sequence,
    point_fits: Sequence[Fit],
    early: Sequence,
    late: Sequence,
    delay: float,
) -> Alarms:
    """The alarms of the base fit to `observations`, its fits to single ones, and the halves of
    recordings.

    `delay` (s) is that of the line.
    """
    corrections = SmoothCorrections(base, observations)
    elements = elements_of(base.twin.rig, observations)
    table = corrections.by_element([*elements, *corrections.promising_positions()])
    return Alarms(
        max(table.values()) - table[NONE, None],
        largest_pull(base),
        largest_disagreement(point_fits),
        drift_p_value(early, late, delay),
    )


def fit_each_observation(workers: Workers, base: Fit) -> list[Fit]:
    """The base fitted to each observation alone; empty for a single observation."""
    count = len(workers.observations)
    if count < 2:
        return []
    start = FromTheta(base.twin.theta)
    return workers.fit([FitJob((), start, observations=(k,)) for k in range(count)])


def largest_pull(fit: Fit) -> tuple[float, str]:
    """Largest distance of a line parameter from the data sheet, in standard deviations as stated,
    and the parameter's name."""
    scale = fit.twin.rig.tolerance_scale
    effects = {f"{effect.name}@{place}" for effect, place in fit.twin.effects}
    pulls = [
        (abs(p.stated_pull(float(u), scale)), p.name)
        for p, u in zip(fit.twin.parameters, fit.twin.theta)
        if p.stated and not p.flat and p.place not in effects
    ]
    return max(pulls, default=(0.0, ""))


def largest_disagreement(fits: Sequence[Fit]) -> tuple[float, str]:
    """Largest difference of a line parameter between fits of single operating points.

    In standard deviations, with the parameter's name. Both posteriors share the prior, so their
    difference has the sum of both variances less what the prior contributed to each.
    """
    worst = (0.0, "")
    for i, a in enumerate(fits):
        effects = {f"{effect.name}@{place}" for effect, place in a.twin.effects}
        for b in fits[i + 1 :]:
            for p in a.twin.parameters:
                if p.flat or p.place in effects or p.name not in b.twin.index:
                    continue
                k, m = a.twin.index[p.name], b.twin.index[p.name]
                va, vb = a.covariance[k, k], b.covariance[m, m]
                variance = va * max(1.0 - va, 0.0) + vb * max(1.0 - vb, 0.0) + 1e-4
                z = abs(a.twin.theta[k] - b.twin.theta[m]) / np.sqrt(variance)
                worst = max(worst, (float(z), p.name))
    return worst


def drift_p_value(early: Sequence, late: Sequence, delay: float) -> tuple[float, str]:
    """Smallest p-value of any recording that both halves are of one state, and its label.

    The shaft angle between the halves is free. The p-value is corrected for the number of
    recordings (Bonferroni). `delay` (s) is that of the line.
    """
    worst = (1.0, "")
    for a, b in zip(early, late):
        if a.orders is None:
            continue
        a, b = at_common_orders(a, b)
        difference, variance = aligned_difference(a, b, delay)
        statistic = 2.0 * np.sum(np.abs(difference) ** 2 / variance)
        p = chdtrc(2 * a.values.size - 1, statistic)
        worst = min(worst, (min(1.0, float(p) * len(early)), a.label))
    return worst


def at_common_orders(a, b) -> tuple:
    """Two periodic observations at the orders that both have."""
    return tuple(
        select_frequencies(x, np.isin(np.asarray(x.orders), np.asarray(other.orders)))
        for x, other in ((a, b), (b, a))
    )


def aligned_difference(a, b, delay: float) -> tuple[np.ndarray, np.ndarray]:
    """b - a (S, F) with aligned shaft angles, and the variance (S, F) that one state allows.

    The variance is that of the noise, of a relative model error, and of what another mean speed
    does to the phase of a sharp resonance.
    """
    orders = np.asarray(a.orders, float)
    power = np.mean(np.abs(a.values) ** 2, axis=0)
    variance = a.variance + b.variance
    speed_change = abs(a.speed_hz / b.speed_hz - 1.0)
    phase = 2 * np.pi * a.frequency_hz * RESONANCE_PASSAGES * delay * speed_change
    variance = variance + (HALVES_MODEL_ERROR**2 + phase**2) * power
    match = np.sum(np.conj(a.values) * b.values / variance, axis=0)
    # Find the angle on a grid over one pitch first, then by the slope of the phase.
    grid = np.linspace(-np.pi, np.pi, 4001) / np.gcd.reduce(np.asarray(a.orders, int))
    angle = grid[np.argmax((np.exp(-1j * np.outer(grid, orders)) @ match).real)]
    for _ in range(3):
        aligned = match * np.exp(-1j * angle * orders)
        angle += np.sum(orders * aligned.imag) / max(np.sum(orders**2 * np.abs(aligned)), 1e-300)
    return b.values * np.exp(-1j * angle * orders) - a.values, variance


def evidence_p_value(log_bayes_factor: float, tried: int) -> float:
    """Upper bound on the probability of so much evidence for one of `tried` hypotheses if no effect
    is present.

    Markov's inequality on the Bayes factor, whose mean under the base is 1, with a union bound over
    the hypotheses.
    """
    return float(min(1.0, tried * np.exp(-min(log_bayes_factor, 700.0))))
