"""Prior sensitivity: would an effect be needed if the data sheet were not trusted?

Recalibrated parameters can absorb missing physics. Each accepted effect is left out and the line is
refitted with wide priors. If that fit is nearly as good, only the data sheet supports the effect,
and the distance of the fit from the data sheet says how firmly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from rippletwin.calibration.fit import Fit
from rippletwin.calibration.misfit import score_fit
from rippletwin.case.model import Rig, Uncertainty
from rippletwin.explanation.checks import alarms
from rippletwin.explanation.fit_jobs import (
    Continuation,
    FitJob,
    FromTheta,
    Workers,
    job_without_effect,
)
from rippletwin.explanation.fit_starts import common_coordinates
from rippletwin.explanation.thresholds import (
    LITTLE_MODEL_ERROR,
    MIN_LOG_BAYES_FACTOR,
    PULL_ALARM,
    WIDE_PRIOR_ERROR_RATIO,
)
from rippletwin.twin.parameters import coordinates
from rippletwin.twin.twin import Twin

WIDENING = 20.0  # factor on the stated uncertainty
MAX_WIDENED_SD = 0.3  # relative, or m for a sensor's position


@dataclass(frozen=True)
class PriorSensitivity:
    """A fit without one effect and with wide priors.

    effect     name of the effect that is left out
    place      where it acts, in words
    evidence   log evidence lost without it, with priors as stated; None if nothing fits
    misfit     relative, in sample, with wide priors and the nominal flow ripple
    parameter  line parameter that moves furthest from the data sheet
    value      its fitted value, `unit`
    nominal    its value on the data sheet, `unit`
    pull       its distance from the data sheet in standard deviations as stated
    rivals     whether this fit is nearly as good as the accepted one, or little evidence is lost
    refutes    whether this fit is so much better, and so far from the data sheet, that the effect
               cannot be what is missing

    A rival is nearly as good in its misfit and in its model error: where the nominal ripple is
    wrong, misfits compare nothing; where a wrong ripple stands for an effect, model errors do not.
    """

    effect: str
    place: str
    evidence: float | None
    misfit: float
    parameter: str
    value: float
    nominal: float
    unit: str
    pull: float
    rivals: bool
    refutes: bool


@dataclass(frozen=True)
class WithoutEffect:
    """The fits without one effect: with priors as stated, and with wide ones, and its misfit."""

    stated: Fit
    wide: Fit
    wide_misfit: float


def fit_without_each_effect(
    workers: Workers, base: Fit, accepted: Fit
) -> tuple[WithoutEffect, ...]:
    """The fits without each accepted effect; `base` is the fit without any.

    With priors as stated the hypothesis is fitted from the accepted fit and by continuation, which
    finds another local mode. From there it is refitted with wide priors.
    """
    rests = [accepted.without(k) for k in range(len(accepted.hypothesis))]
    jobs = [job_without_effect(accepted, k, workers.base) for k in range(len(rests))]
    jobs += [FitJob(rest, Continuation((common_coordinates(accepted, rest),))) for rest in rests]
    fits = workers.fit(jobs)
    stated_fits = [max(p, key=lambda f: f.evidence) for p in zip(fits, fits[len(rests) :])]
    if len(rests) == 1:
        stated_fits = [max(base, stated_fits[0], key=lambda f: f.evidence)]
    wide_fits = refit_with_wide_priors(workers, stated_fits, accepted)
    return tuple(
        WithoutEffect(s, wide, misfit) for s, (misfit, wide) in zip(stated_fits, wide_fits)
    )


def compare_without_each_effect(
    workers: Workers, accepted: Fit, without: Sequence[WithoutEffect]
) -> tuple[PriorSensitivity, ...]:
    """`PriorSensitivity` of every accepted effect, given the fits without each."""
    accepted_misfit = score_fit(accepted, workers.observations).misfit
    line = workers.base
    results = []
    for (effect, place), each in zip(accepted.hypothesis, without):
        stated, wide, misfit = each.stated, each.wide, each.wide_misfit
        theta = coordinates(line.parameters, wide.twin.values())
        pull, name = alarms.largest_pull(replace(wide, twin=line.with_(theta=theta)))
        parameter = line.parameters[line.index[name]]
        lost = accepted.evidence - stated.evidence
        results.append(
            PriorSensitivity(
                effect=effect.name,
                place=str(place),
                evidence=lost if np.isfinite(lost) else None,
                misfit=misfit,
                parameter=parameter.name,
                value=wide.twin.values()[parameter.name],
                nominal=parameter.nominal,
                unit=parameter.unit,
                pull=pull,
                rivals=bool(
                    (
                        misfit < WIDE_PRIOR_ERROR_RATIO * accepted_misfit
                        and wide.model_error < WIDE_PRIOR_ERROR_RATIO * accepted.model_error
                    )
                    or lost < MIN_LOG_BAYES_FACTOR
                ),
                # A misfit below the model error says nothing.
                refutes=bool(
                    pull > PULL_ALARM
                    and WIDE_PRIOR_ERROR_RATIO * max(misfit, LITTLE_MODEL_ERROR) < accepted_misfit
                ),
            )
        )
    return tuple(results)


def refit_with_wide_priors(
    workers: Workers, fits: Sequence[Fit], accepted: Fit
) -> list[tuple[float, Fit]]:
    """(misfit, fit) of each of `fits` refitted with wide priors.

    Each starts from its mode and from that of `accepted`; the one of more evidence is taken.
    """
    jobs = []
    for fit in fits:
        twin = fit.twin
        base = Twin(
            widen_priors(twin.rig),
            workers.observations,
            friction=twin.friction,
            source_sd=twin.source_sd,
            guessed_load=twin.guessed_load,
            uncertain_pump=twin.uncertain_pump,
            changing_state=twin.changing_state,
        )
        parameters = base.with_(effects=fit.hypothesis).parameters
        for start in (twin, accepted.twin):
            theta = coordinates(parameters, start.values())
            jobs.append(
                FitJob(fit.hypothesis, FromTheta(theta), base=base, source_free=fit.source_free)
            )
    refits = workers.fit(jobs)
    best = [max(pair, key=lambda fit: fit.evidence) for pair in zip(refits[::2], refits[1::2])]
    return [(score_fit(fit, workers.observations).misfit, fit) for fit in best]


def widen_priors(rig: Rig) -> Rig:
    """The rig with WIDENING times the stated uncertainty, at most MAX_WIDENED_SD.

    Nowhere less than stated.
    """
    stated = {f.name: getattr(rig.uncertainty, f.name) for f in fields(Uncertainty)}
    wide = {name: max(sd, min(WIDENING * sd, MAX_WIDENED_SD)) for name, sd in stated.items()}
    return replace(rig, uncertainty=Uncertainty(**wide))
