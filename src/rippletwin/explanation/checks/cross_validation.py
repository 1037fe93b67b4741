"""Cross-validation: does the explanation predict data that it was not fitted to?

Real physics transfers to another operating point; an effect that only absorbs error does not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rippletwin.calibration.fit import Fit
from rippletwin.calibration.levenberg_marquardt import descend
from rippletwin.calibration.misfit import Score, root_mean_square, score_fit
from rippletwin.calibration.posterior import Posterior
from rippletwin.calibration.ripple_correction import correct_ripple
from rippletwin.calibration.shaft_angles import fit_shaft_angles
from rippletwin.errors import InputError
from rippletwin.explanation.fit_jobs import Workers, job_from
from rippletwin.spectra.frequency_selection import select_frequencies
from rippletwin.spectra.observation import Observation

UNDETERMINED_VARIANCE = 0.5  # of a coordinate in a fold; its prior has 1
HELD_OUT_STEPS = 8  # of the descent in shaft angle and state of a recording that was left out
Halves = tuple[Observation, Observation]
"""A single periodic recording's first and second half."""
FREQUENCY_BLOCKS = 8  # of a single spectrum, every second of which is held out


@dataclass(frozen=True)
class Validation:
    """Scores of the base ("before") and the explanation ("after"), in sample and held out.

    The explanation corrects the pump's flow ripple as well as the line.

    nominal_ripple  those of the explanation with the nominal ripple of the pump in its place
    calibrated      those of the plain calibration without effects; None if it was not made
    left_out        what each fold left out, in words
    disagreement    largest of an effect's parameter between a fold and the whole fit, in standard
                    deviations
    model_error     of the explanation, relative, as the data that were left out show it
    """

    before: dict[str, Score]
    after: dict[str, Score]
    nominal_ripple: dict[str, Score]
    left_out: tuple[str, ...]
    disagreement: float
    model_error: float
    calibrated: dict[str, Score] | None = None

    @property
    def without_effects(self) -> dict[str, Score]:
        """The best scores without effects: those of the base or of the plain calibration.

        The base is fitted with an error model that leaves large residuals to an error of the
        source. Its misfit would be an unfair figure beside that of an explanation.
        """
        candidates = [self.before] if self.calibrated is None else [self.before, self.calibrated]
        return min(candidates, key=lambda scores: scores["in_sample"].misfit)


def cross_validate(
    workers: Workers,
    base: Fit,
    best: Fit,
    halves: Halves | None = None,
    calibrated: Fit | None = None,
) -> Validation:
    """Cross-validate the base and the best fit, and the plain calibration if there is one.

    The folds are those of `make_folds`. Every fold starts from the modes of the whole fits: the
    folds differ in their data only.
    """
    fits = [base, best] if calibrated is None else [base, best, calibrated]
    folds = make_folds(workers, halves)
    jobs = [job_from(f, observations=fold.indices) for fold in folds for f in fits]
    if all(fold.workers is workers for fold in folds):
        flat = workers.fit(jobs)  # all folds side by side
    else:
        flat = [fit for fold in folds for fit in fold.workers.fit([job_from(f) for f in fits])]
    refitted = [flat[len(fits) * k : len(fits) * (k + 1)] for k in range(len(folds))]
    before, after, *plain = (
        _score(fit, [r[k] for r in refitted], folds, workers.observations)
        for k, fit in enumerate(fits)
    )
    parts = [(fits[1], fold.left_out) for fits, fold in zip(refitted, folds)]
    disagreement = find_disagreement(best, parts)
    return Validation(
        before,
        _score(best, [r[1] for r in refitted], folds, workers.observations, corrects_ripple=True),
        after,
        tuple(fold.left_out for fold in folds),
        0.0 if disagreement is None else disagreement.deviations,
        root_mean_square(
            [predict_held_out(r[1], f.held_out)[0].model_error for r, f in zip(refitted, folds)]
        ),
        *plain,
    )


def score_held_out(workers: Workers, fit: Fit, halves: Halves | None = None) -> Score:
    """Score of refits of one fit to the folds on what those leave out, as `Validation.after` has
    it: the pump's flow ripple is corrected."""
    folds = make_folds(workers, halves)
    refitted = [fold.workers.fit([job_from(fit, observations=fold.indices)])[0] for fold in folds]
    return _score(fit, refitted, folds, workers.observations, corrects_ripple=True)["held_out"]


def _score(
    fit: Fit,
    refitted: Sequence[Fit],
    folds: Sequence[Fold],
    observations: Sequence,
    corrects_ripple: bool = False,
) -> dict[str, Score]:
    """Scores of a fit in sample, and of its refits to the folds on what those left out.

    corrects_ripple   whether the flow ripple is corrected, by the data of the same fit alone
    """
    ripple = correct_ripple(fit, observations) if corrects_ripple else None
    each = [
        score_fit(
            refit,
            fold.held_out,
            turn=True,
            ripple=correct_ripple(refit, fold.fitted) if corrects_ripple else None,
        )
        for refit, fold in zip(refitted, folds)
    ]
    return {
        "in_sample": score_fit(fit, observations, ripple=ripple),
        "held_out": Score(
            root_mean_square([s.misfit for s in each]), root_mean_square([s.theil for s in each])
        ),
    }


@dataclass(frozen=True)
class Fold:
    """Data to fit and data that are held out.

    workers    run fits of the fold's data, those with `indices` of their observations (None: all)
    held_out   the observations that are not fitted
    left_out   what they are, in words
    """

    workers: Workers
    indices: tuple[int, ...] | None
    held_out: list
    left_out: str

    @property
    def fitted(self) -> list:
        """The observations that are fitted."""
        every = self.workers.observations
        return every if self.indices is None else [every[k] for k in self.indices]


def make_folds(workers: Workers, halves: Halves | None = None) -> list[Fold]:
    """The folds of the observations of `workers`.

    Each operating point is held out in turn. With a single one, the second of its `halves` is held
    out, or without halves every second block of frequencies.
    """
    observations = workers.observations
    count = len(observations)
    if count > 1:
        return [
            Fold(
                workers,
                tuple(k for k in range(count) if k != left),
                [observations[left]],
                f"recording {observations[left].label}",
            )
            for left in range(count)
        ]
    if halves is not None:
        early, late = halves
        own = Workers(workers.base, [early])
        return [Fold(own, None, [late], "the second half of the recording")]
    (observation,) = observations
    frequencies = len(observation.frequency_hz)
    if frequencies < 2:
        raise InputError(
            observation.label,
            "min_frequency_hz, max_frequency_hz",
            "one frequency is fitted, so that none can be held out",
            "Give a wider band, or a recording of another operating point",
        )
    blocks = min(FREQUENCY_BLOCKS, frequencies)
    block = np.floor(blocks * np.arange(frequencies) / frequencies)
    folds = []
    for parity, words in enumerate(("even", "odd")):  # counted from 1, of what is held out
        inside = block % 2 == parity
        own = Workers(workers.base, [select_frequencies(observation, inside)])
        held_out = [select_frequencies(observation, ~inside)]
        folds.append(Fold(own, None, held_out, f"{words} eighths of the band"))
    return folds


def predict_held_out(fit: Fit, observations: Sequence) -> tuple[Posterior, np.ndarray]:
    """The posterior of observations that a fit was not made of, and theta (P,) for them.

    Shaft angles and the state of each recording are free, and the sizes of the errors are those
    that suit the observations best: another operating point has other errors.
    """
    posterior = Posterior(fit.twin, observations, None, fit.source_free)
    labels = {f"{kind}[{o.label}]" for o in observations for kind in ("angle", "state")}
    theta = fit_shaft_angles(posterior, fit.twin.theta)
    fixed = [k for k, p in enumerate(fit.twin.parameters) if p.name not in labels]
    theta, _ = descend(posterior, theta, HELD_OUT_STEPS, fixed)
    return posterior, theta


@dataclass(frozen=True)
class Disagreement:
    """How far a parameter of an effect is in a fit to a part of the data from that to all data.

    deviations    in standard deviations of the difference
    parameter     its name in the twin
    whole, part   its values in SI units, of all data and of the part
    left_out      what the part leaves out, in words
    """

    deviations: float
    parameter: str
    whole: float
    part: float
    left_out: str


def find_disagreement(
    whole: Fit, parts: Sequence[tuple[Fit, str]], label: str = ""
) -> Disagreement | None:
    """The largest disagreement of a parameter of an effect; None where there is nothing to compare.

    parts   fits to parts of the data, with what each leaves out
    label   beginning of the names of the parameters of one effect; "" for all effects

    A part's data are among those of the whole, so the variance of the difference is the part's less
    the whole's; it is at least a quarter of the part's. A parameter that the part determines hardly
    better than its prior cannot disagree, as a pressure exponent at one pressure.
    """
    found, values = [], whole.twin.values()
    for part, left_out in parts:
        part_values = part.twin.values()
        for p in whole.twin.parameters:
            if "@" not in p.name or not p.name.startswith(label):
                continue
            k, m = whole.twin.index[p.name], part.twin.index[p.name]
            part_variance = part.covariance[m, m]
            if part_variance > UNDETERMINED_VARIANCE:
                continue
            variance = max(part_variance - whole.covariance[k, k], 0.25 * part_variance) + 1e-4
            z = float(abs(whole.twin.theta[k] - part.twin.theta[m]) / np.sqrt(variance))
            found.append(Disagreement(z, p.name, values[p.name], part_values[p.name], left_out))
    return max(found, key=lambda each: each.deviations, default=None)
