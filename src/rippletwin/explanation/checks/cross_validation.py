"""Does the explanation hold on data it has not seen, and do its parameters agree between folds?

Real physics transfers to another operating point; an absorber does not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rippletwin.calibration.fit import Fit
from rippletwin.calibration.misfit import Score, score_fit
from rippletwin.explanation.fit_jobs import Workers, job_without_effect
from rippletwin.explanation.thresholds import SURE
from rippletwin.spectra.frequency_selection import select_frequencies

UNDETERMINED_VARIANCE = 0.5  # variance of a coordinate whose prior has 1
LITTLE_MISFIT = 1 / 3  # of the held-out misfit
MAX_FOLD_DIFFERENCE = (
    3.5  # standard deviations between a fold's parameter of an effect and the whole fit's
)


@dataclass(frozen=True)
class Validation:
    """Base ("before") and explanation ("after") in sample and held out.

    left_out     what each fold left out, in words
    disagreement largest difference of an effect's parameter between a fold and the whole, in
                 standard deviations
    """

    before: dict[str, Score]
    after: dict[str, Score]
    left_out: tuple[str, ...]
    disagreement: float

    @property
    def passes(self) -> bool:
        """Whether the held-out misfit improves, and the parameters agree or little is left of it.

        An absorber gains little on data it has not seen. What removes most of the misfit there is
        none, though a fold of one operating point may have placed a parameter elsewhere.
        """
        before, after = (which["held_out"].misfit for which in (self.before, self.after))
        return after < LITTLE_MISFIT * before or (
            after < before and self.disagreement < MAX_FOLD_DIFFERENCE
        )

    @property
    def transfers(self) -> bool:
        """Whether the explanation fits what it has not seen better than the base does."""
        return self.after["held_out"].misfit < self.before["held_out"].misfit

    @property
    def gains(self) -> bool:
        """Whether the explanation fits better than the base anywhere, in sample or held out.

        What does not, and has log evidence all the same, only spares the line's numbers a way from
        the data sheet.
        """
        return any(self.after[k].misfit < self.before[k].misfit for k in ("in_sample", "held_out"))


def cross_validate(pool: Workers, base: Fit, best: Fit, late: Sequence | None = None) -> Validation:
    """Folds over operating points; with one only, over its late windows `late`, else frequencies.

    Every fold's fits start from the whole fits: they are close, and the folds differ in data only.
    """
    observations = pool.observations
    count = len(observations)
    fits = [base, best]
    if count > 1:
        folds = [[k for k in range(count) if k != left] for left in range(count)]
        held = [[observations[left]] for left in range(count)]
        words = tuple(f"recording {o.label}" for o in observations)
        refitted = _refit(pool, fits, folds)
    elif late is not None:
        folds, held, words = [[0]], [list(late)], ("the second half of the recording",)
        refitted = _refit(pool, fits, folds)
    else:
        folds, held, words, refitted = _frequency_folds(pool, fits)
    in_sample = [score_fit(fit, observations) for fit in fits]
    outside = []
    for which in range(2):
        scores = [score_fit(fold[which], h, turn=True) for fold, h in zip(refitted, held)]
        outside.append(Score(_rms([s.misfit for s in scores]), _rms([s.theil for s in scores])))
    return Validation(
        {"in_sample": in_sample[0], "held_out": outside[0]},
        {"in_sample": in_sample[1], "held_out": outside[1]},
        words,
        max((_difference(best, fold[1]) for fold in refitted), default=0.0),
    )


def prune_by_cross_validation(pool: Workers, best: Fit, late: Sequence | None = None) -> Fit:
    """`best` without those of its effects that do not help on data left out.

    The one whose loss costs least evidence is tried first. What no line is without stays, and what
    is worth SURE: misfits weigh all harmonics alike, the evidence knows which are well known.
    """
    while len(best.hypothesis) > 1:
        jobs = [
            job_without_effect(best, k, pool.base)
            for k, (effect, _) in enumerate(best.hypothesis)
            if not effect.certain
        ]
        without = max(pool.fit(jobs), key=lambda fit: fit.evidence, default=None)
        if without is None or best.evidence - without.evidence > SURE:
            break
        if cross_validate(pool, without, best, late).passes:
            break
        best = without
    return best


def _refit(pool: Workers, fits: list[Fit], folds: list[list[int]]) -> list[list[Fit]]:
    jobs = [
        {"hypothesis": f.hypothesis, "theta": f.twin.theta, "use": use}
        for use in folds
        for f in fits
    ]
    flat = pool.fit(jobs)
    return [flat[2 * k : 2 * k + 2] for k in range(len(folds))]


def _frequency_folds(pool: Workers, fits: list[Fit]):
    """Every second stretch of an eighth of the band left out of a single spectrum."""
    observation = pool.observations[0]
    part = np.floor(8 * np.arange(len(observation.frequency_hz)) / len(observation.frequency_hz))
    held, refitted = [], []
    for parity in (0, 1):
        inside = part % 2 == parity
        kept = [select_frequencies(observation, inside)]
        rest = Workers(pool.base, kept)
        held.append([select_frequencies(observation, ~inside)])
        refitted.append(
            rest.fit([{"hypothesis": f.hypothesis, "theta": f.twin.theta} for f in fits])
        )
    words = ("odd eighths of the band", "even eighths of the band")
    return [[0], [0]], held, words, refitted


def _difference(whole: Fit, fold: Fit) -> float:
    """Largest difference of an effect's parameter in the fold's standard deviations.

    The fold's data are part of the whole's, so that the variance of the difference is the fold's
    less the whole's; it is held above a quarter of the fold's. A parameter of which the fold knows
    hardly more than its prior, as a pressure exponent at one pressure, cannot disagree.
    """
    worst = 0.0
    for p in whole.twin.parameters:
        if "@" in p.name:
            k, m = whole.twin.index[p.name], fold.twin.index[p.name]
            own = fold.covariance[m, m]
            if own > UNDETERMINED_VARIANCE:
                continue
            variance = max(own - whole.covariance[k, k], 0.25 * own) + 1e-4
            z = abs(whole.twin.theta[k] - fold.twin.theta[m]) / np.sqrt(variance)
            worst = max(worst, float(z))
    return worst


def _rms(values: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
