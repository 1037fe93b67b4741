"""Probability of detection against severity, at a fixed share of false alarms.

A hit/miss curve: the logistic of the logarithm of severity, fitted by maximum penalised likelihood
(MIL-HDBK-1823A, 2009, section G.3; the penalty keeps the slope finite where one severity separates
hits from misses).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize
from scipy.special import expit, log_expit, logit

from concealed.summary import Rate, rate_of

FALSE_ALARMS = 0.05
SLOPE_SD = 10.0  # of the penalty: standard deviation of the slope a decade of severity
FOUND = (0.5, 0.9)  # probabilities of detection at which a severity is called the smallest found
RESAMPLED = 200
LEAST_CHANGE = 1e-3  # smaller changes are shown here
BINS = 6  # of equally many recordings each, in which shares are shown beside a curve


class DetectionCurve(NamedTuple):
    """P(severity) = expit(slope (log10 severity - middle))."""

    middle: float
    slope: float

    def probability(self, severity: np.ndarray) -> np.ndarray:
        """Probability of detection (N,) at severities (N,)."""
        return expit(self.slope * (np.log10(severity) - self.middle))

    def severity(self, probability: float) -> float:
        """The severity that is detected with this probability."""
        return float(10 ** (self.middle + logit(probability) / self.slope))


class Leaks(NamedTuple):
    """Recordings of one fault: their rows, and which of them (N,) raise the alarm, beside the rows
    of the healthy recordings."""

    rows: list[dict]
    hit: np.ndarray
    healthy: list[dict]

    @property
    def change(self) -> np.ndarray:
        """The ripple's relative change (N,)."""
        return np.array([row["change"] for row in self.rows])

    @property
    def shown(self) -> np.ndarray:
        """The same (N,) as it is drawn: LEAST_CHANGE at least."""
        return np.maximum(self.change, LEAST_CHANGE)


def detect_leaks(rows: Sequence[dict], state: str) -> Leaks:
    """The recordings of a state among rows of one column, and which of them raise the alarm that
    at most FALSE_ALARMS of the healthy ones raise; none does where no healthy one is there."""
    healthy = [row for row in rows if row["state"] == "healthy"]
    threshold = alarm_threshold([row["suspicion"] for row in healthy]) if healthy else np.inf
    chosen = [row for row in rows if row["state"] == state]
    return Leaks(chosen, np.array([row["suspicion"] > threshold for row in chosen], bool), healthy)


class BinShare(NamedTuple):
    """Share detected of neighbouring severities, with its exact 95 % interval."""

    severity: float
    rate: Rate


def shares_in_bins(severity: np.ndarray, hit: np.ndarray) -> list[BinShare]:
    """Shares detected in bins of about equally many recordings, each at its geometric mean."""
    if not len(severity):
        return []
    parts = np.array_split(np.argsort(severity), min(BINS, len(severity)))
    return [
        BinShare(float(np.exp(np.mean(np.log(severity[part])))), rate_of(hit[part]))
        for part in parts
    ]


def alarm_threshold(healthy: Sequence[float]) -> float:
    """The least suspicion above which at most FALSE_ALARMS of the healthy recordings are."""
    ordered = np.sort(np.asarray(healthy, float))[::-1]
    return float(ordered[int(FALSE_ALARMS * len(ordered))])


def fit_curve(
    severity: Sequence[float], detected: Sequence[bool], start: DetectionCurve | None = None
) -> DetectionCurve | None:
    """The detection curve of recordings; None where there are fewer than five of them.

    Without a curve to `start` from it is sought from several.
    """
    x, sign = np.log10(np.asarray(severity, float)), np.where(detected, 1.0, -1.0)
    if len(x) < 5:
        return None
    mean, spread = x.mean(), max(x.std(), 0.1)

    def minus_log_posterior(parameters: np.ndarray) -> float:
        middle, log_slope = parameters
        slope = np.exp(log_slope)
        likelihood = log_expit(slope * (x - middle) * sign).sum()
        prior = ((middle - mean) / (3 * spread)) ** 2 + (slope / SLOPE_SD) ** 2
        return -likelihood + 0.5 * prior

    starts = [(m, s) for m in np.quantile(x, [0.1, 0.4, 0.8]) for s in (0.5, 2.0)]
    if start is not None:
        starts = [(start.middle, np.log(start.slope))]
    best = min(
        (minimize(minus_log_posterior, each, method="Nelder-Mead") for each in starts),
        key=lambda result: result.fun,
    )
    return DetectionCurve(float(best.x[0]), float(np.exp(best.x[1])))


def smallest_found(
    leaks: Leaks, severity: Sequence[float], probability: float, rng: np.random.Generator
) -> tuple[float, float, float] | None:
    """The severity detected with `probability`, and its 95 % interval by resampling whole rigs, of
    `leaks` with `severity` (N,).

    Recordings of one rig go together: they share its twin (Davison, Hinkley, Bootstrap Methods,
    1997, section 3.8). The alarm is that of the resampled healthy recordings.
    """
    severity = np.asarray(severity)
    curve = fit_curve(severity, leaks.hit)
    if curve is None:
        return None
    suspicion, rigs = (np.array([row[key] for row in leaks.rows]) for key in ("suspicion", "rig"))
    known, own = (np.array([row[key] for row in leaks.healthy]) for key in ("suspicion", "rig"))
    members = [
        (np.flatnonzero(rigs == rig), np.flatnonzero(own == rig)) for rig in np.union1d(rigs, own)
    ]
    drawn = []
    for _ in range(RESAMPLED):
        picked = [members[k] for k in rng.integers(len(members), size=len(members))]
        leaking, healthy = map(np.concatenate, zip(*picked))
        if not len(healthy):
            continue
        hit = suspicion[leaking] > alarm_threshold(known[healthy])
        again = fit_curve(severity[leaking], hit, curve)
        if again is not None:
            drawn.append(again.severity(probability))
    low, high = np.quantile(drawn, [0.025, 0.975]) if drawn else (np.nan, np.nan)
    return curve.severity(probability), float(low), float(high)
