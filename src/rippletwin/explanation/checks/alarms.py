"""Is anything missing at all? Three alarms, and drift within a recording.

Refitting hides what is missing, so a good fit proves nothing. The alarms are the misfit left after
refitting, the pull of the parameters on their priors (where an absorbed effect shows), and the
disagreement of parameters fitted to each operating point alone. What decides is the evidence that
the best effect of the whole library adds (`rippletwin.explanation.thresholds.ACCEPT`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from rippletwin.calibration.fit import Fit
from rippletwin.calibration.posterior import MIN_MODEL_ERROR
from rippletwin.spectra.frequency_selection import select_frequencies

MISFIT_ALARM = 3.0 * MIN_MODEL_ERROR  # relative model error above which a fit is bad
PULL_ALARM = 4.0  # prior standard deviations
DISAGREEMENT_ALARM = 4.0  # standard deviations between two operating points
DRIFT_SIGNIFICANCE = 1e-3
RESONANCE_PASSAGES = (
    100.0  # of the line that a wave makes in a sharp resonance, whose phase the speed turns
)


@dataclass(frozen=True)
class Alarms:
    """What each alarm reads, and whether it rings.

    misfit         relative model error left in the base fit
    pull           largest |coordinate| of a parameter with a prior, and whose
    disagreement   largest difference between operating points, in standard deviations, and whose
    drift          p-value that early and late windows are one state, and of which recording
    """

    misfit: float
    pull: tuple[float, str]
    disagreement: tuple[float, str]
    drift: tuple[float, str]

    @property
    def ringing(self) -> tuple[str, ...]:
        """Names of the alarms that ring."""
        rings = {
            "misfit": self.misfit > MISFIT_ALARM,
            "pull": self.pull[0] > PULL_ALARM,
            "disagreement": self.disagreement[0] > DISAGREEMENT_ALARM,
            "drift": self.drift[0] < DRIFT_SIGNIFICANCE,
        }
        return tuple(name for name, rung in rings.items() if rung)


def largest_pull(fit: Fit) -> tuple[float, str]:
    """Largest pull of a line parameter on its prior, and the parameter's name."""
    pulls = [
        (abs(float(u)), p.name)
        for p, u in zip(fit.twin.parameters, fit.twin.theta)
        if not p.flat and "@" not in p.name
    ]
    return max(pulls, default=(0.0, ""))


def largest_effect_pull(fit: Fit) -> float:
    """Largest pull of an effect's own parameter on its prior. Where along the line it sits is no
    strain: one place is as likely as another."""
    pulls = [
        abs(float(u))
        for p, u in zip(fit.twin.parameters, fit.twin.theta)
        if "@" in p.name and p.prior.kind != "uniform"
    ]
    return max(pulls, default=0.0)


def largest_disagreement(fits: Sequence[Fit]) -> tuple[float, str]:
    """Largest difference of a line parameter between fits to single operating points.

    Two posteriors of one parameter share its prior: the variance of their difference is that of
    both less what the prior gave both, which is held positive.
    """
    worst = (0.0, "")
    for i, a in enumerate(fits):
        for b in fits[i + 1 :]:
            for p in a.twin.parameters:
                if p.flat or "@" in p.name or p.name not in b.twin.index:
                    continue
                k, m = a.twin.index[p.name], b.twin.index[p.name]
                va, vb = a.covariance[k, k], b.covariance[m, m]
                variance = va * max(1.0 - va, 0.0) + vb * max(1.0 - vb, 0.0) + 1e-4
                z = abs(a.twin.theta[k] - b.twin.theta[m]) / np.sqrt(variance)
                worst = max(worst, (float(z), p.name))
    return worst


def drift_p_value(early: Sequence, late: Sequence, delay: float) -> tuple[float, str]:
    """Smallest p-value, over recordings, that two parts of it agree, and the recording's label.

    The shaft angle between the parts is free, the covariances are the parts' own, and a relative
    error is allowed: half the model's floor, and what another mean speed does to the phase of the
    passages of the line that a sharp resonance is made of. Corrected for the number of recordings.
    """
    worst = (1.0, "")
    for a, b in zip(early, late):
        if a.orders is None:
            continue
        a, b = at_common_orders(a, b)
        gap, variance = aligned_difference(a, b, delay)
        statistic = 2.0 * np.sum(np.abs(gap) ** 2 / variance)
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
    """b less a (S, F), their shaft angle aligned, and the variance that `drift` allows for."""
    orders = np.asarray(a.orders, float)
    power = np.mean(np.abs(a.values) ** 2, axis=0)
    variance = np.einsum("fss->sf", a.covariance + b.covariance).real
    speed = abs(a.speed_hz / b.speed_hz - 1.0)
    phase = 2 * np.pi * a.frequency_hz * RESONANCE_PASSAGES * delay * speed
    variance = variance + ((0.5 * MIN_MODEL_ERROR) ** 2 + phase**2) * power
    match = np.sum(np.conj(a.values) * b.values / variance, axis=0)
    # The angle: first coarsely, from the strongest order, then refined by the phase slope.
    grid = np.linspace(-np.pi, np.pi, 4001) / np.gcd.reduce(np.asarray(a.orders, int))
    angle = grid[np.argmax((np.exp(-1j * np.outer(grid, orders)) @ match).real)]
    for _ in range(3):
        turned = match * np.exp(-1j * angle * orders)
        angle += np.sum(orders * turned.imag) / max(np.sum(orders**2 * np.abs(turned)), 1e-300)
    return b.values * np.exp(-1j * angle * orders) - a.values, variance


def evidence_p_value(gain: float, tried: int) -> float:
    """Bound on the chance of so much evidence from `tried` effects without any: Markov's inequality
    on the Bayes factor, whose mean is 1 under the base, summed over the library."""
    return float(min(1.0, tried * np.exp(-min(gain, 700.0))))
