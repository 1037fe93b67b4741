"""Cross-validation: does the explanation predict data that it was not fitted to?

Real physics transfers to another operating point; an effect that only absorbs error does not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rippletwin.calibration.fit import Fit
from rippletwin.calibration.misfit import Score, score_fit
from rippletwin.explanation.fit_jobs import Workers, job_from, job_without_effect
from rippletwin.explanation.thresholds import (
    DECISIVE_LOG_BAYES_FACTOR,
    MAX_FOLD_DIFFERENCE,
    SMALL_HELD_OUT_SHARE,
)
from rippletwin.spectra.frequency_selection import select_frequencies

UNDETERMINED_VARIANCE = 0.5  # of a coordinate in a fold; its prior has 1
FREQUENCY_BLOCKS = 8  # of a single spectrum, every second of which is held out


@dataclass(frozen=True)
class Validation:
    """Scores of the base ("before") and the explanation ("after"), in sample and held out.

    calibrated    those of the plain calibration without effects; None if it was not made
    left_out      what each fold left out, in words
    disagreement  largest difference of an effect's parameter between a fold and the whole fit, in
                  standard deviations
    """

    before: dict[str, Score]
    after: dict[str, Score]
    left_out: tuple[str, ...]
    disagreement: float
    calibrated: dict[str, Score] | None = None

    @property
    def without_effects(self) -> dict[str, Score]:
        """The best scores without effects: those of the base or of the plain calibration.

        The base is fitted with an error model that leaves large residuals to an error of the
        source. Its misfit would be an unfair figure beside that of an explanation.
        """
        candidates = [self.before] if self.calibrated is None else [self.before, self.calibrated]
        return min(candidates, key=lambda scores: scores["in_sample"].misfit)

    @property
    def passes(self) -> bool:
        """Whether the explanation holds on held-out data.

        Either most of the held-out misfit is gone, or it improves and the folds agree on the
        parameters. A fold of one operating point may misplace a parameter, but nothing that only
        absorbs error removes most of the held-out misfit.
        """
        before, after = (which["held_out"].misfit for which in (self.before, self.after))
        return after < SMALL_HELD_OUT_SHARE * before or (
            after < before and self.disagreement < MAX_FOLD_DIFFERENCE
        )

    @property
    def transfers(self) -> bool:
        """Whether the explanation fits held-out data better than the base."""
        return self.after["held_out"].misfit < self.before["held_out"].misfit

    @property
    def fits_better(self) -> bool:
        """Whether the explanation fits better than the base, in sample or held out.

        Evidence without a better fit means only that line parameters stay closer to the data sheet.
        """
        return any(self.after[k].misfit < self.before[k].misfit for k in ("in_sample", "held_out"))


def cross_validate(
    workers: Workers,
    base: Fit,
    best: Fit,
    late: Sequence | None = None,
    calibrated: Fit | None = None,
) -> Validation:
    """Cross-validate the base and the best fit, and the plain calibration if there is one.

    The folds are operating points. With a single one, `late`, its late windows, are held out, or
    else blocks of frequencies. Every fold starts from the modes of the whole fits: the folds differ
    in their data only.
    """
    fits = [base, best] if calibrated is None else [base, best, calibrated]
    observations = workers.observations
    count = len(observations)
    if count > 1:
        folds = [tuple(k for k in range(count) if k != left) for left in range(count)]
        held_out = [[observations[left]] for left in range(count)]
        left_out = tuple(f"recording {o.label}" for o in observations)
        refitted = _refit_folds(workers, fits, folds)
    elif late is not None:
        held_out, left_out = [list(late)], ("the second half of the recording",)
        refitted = _refit_folds(workers, fits, [(0,)])
    else:
        held_out, left_out, refitted = _refit_frequency_folds(workers, fits)
    scores = []
    for which, fit in enumerate(fits):
        folds = [score_fit(fold[which], h, turn=True) for fold, h in zip(refitted, held_out)]
        outside = Score(_rms([s.misfit for s in folds]), _rms([s.theil for s in folds]))
        scores.append({"in_sample": score_fit(fit, observations), "held_out": outside})
    return Validation(
        scores[0],
        scores[1],
        left_out,
        max((_largest_difference(best, fold[1]) for fold in refitted), default=0.0),
        None if calibrated is None else scores[2],
    )


def prune_by_cross_validation(workers: Workers, best: Fit, late: Sequence | None = None) -> Fit:
    """`best` without the effects that do not improve the fit of held-out data.

    The effect with the least evidence is tried first. Always-present effects stay, and so do those
    with decisive evidence: misfits weight all harmonics alike, while evidence weights each by its
    error.
    """
    while len(best.hypothesis) > 1:
        jobs = [
            job_without_effect(best, k, workers.base)
            for k, (effect, _) in enumerate(best.hypothesis)
            if not effect.certain
        ]
        reduced = max(workers.fit(jobs), key=lambda fit: fit.evidence, default=None)
        if reduced is None or best.evidence - reduced.evidence > DECISIVE_LOG_BAYES_FACTOR:
            break
        if cross_validate(workers, reduced, best, late).passes:
            break
        best = reduced
    return best


def _refit_folds(
    workers: Workers, fits: Sequence[Fit], folds: Sequence[tuple[int, ...]]
) -> list[list[Fit]]:
    """The fits refitted to the observations with the indices of each fold."""
    flat = workers.fit([job_from(f, observations=fold) for fold in folds for f in fits])
    return [flat[len(fits) * k : len(fits) * (k + 1)] for k in range(len(folds))]


def _refit_frequency_folds(workers: Workers, fits: Sequence[Fit]) -> tuple:
    """(held-out observations, what they are, refitted fits) of two folds over a single spectrum.

    Each fold holds out every second block of frequencies.
    """
    observation = workers.observations[0]
    count = len(observation.frequency_hz)
    block = np.floor(FREQUENCY_BLOCKS * np.arange(count) / count)
    held_out, refitted = [], []
    for parity in (0, 1):
        inside = block % 2 == parity
        fold = Workers(workers.base, [select_frequencies(observation, inside)])
        held_out.append([select_frequencies(observation, ~inside)])
        refitted.append(fold.fit([job_from(f) for f in fits]))
    return held_out, ("odd eighths of the band", "even eighths of the band"), refitted


def _largest_difference(whole: Fit, fold: Fit) -> float:
    """Largest difference of an effect's parameter between a fold and the whole fit.

    In standard deviations. The fold's data are part of the whole's, so the variance of the
    difference is the fold's less the whole's; it is at least a quarter of the fold's. A parameter
    that the fold determines hardly better than its prior cannot disagree, as a pressure exponent at
    one pressure.
    """
    largest = 0.0
    for p in whole.twin.parameters:
        if "@" in p.name:
            k, m = whole.twin.index[p.name], fold.twin.index[p.name]
            fold_variance = fold.covariance[m, m]
            if fold_variance > UNDETERMINED_VARIANCE:
                continue
            variance = max(fold_variance - whole.covariance[k, k], 0.25 * fold_variance) + 1e-4
            z = abs(whole.twin.theta[k] - fold.twin.theta[m]) / np.sqrt(variance)
            largest = max(largest, float(z))
    return largest


def _rms(values: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
