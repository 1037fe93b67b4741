"""The sheet or the physics: what a free data sheet would make of the data without an effect.

Recalibration swallows physics. Where a fit without an accepted effect does nearly as well once the
line's numbers may go anywhere, what speaks for the effect is the data sheet, and how far the fit
has to leave it says how firmly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from rippletwin.calibration.fit import Fit
from rippletwin.calibration.misfit import score_fit
from rippletwin.calibration.posterior import MIN_MODEL_ERROR
from rippletwin.case.model import Rig, Uncertainty
from rippletwin.explanation.checks import alarms
from rippletwin.explanation.fit_jobs import Workers, common_coordinates
from rippletwin.explanation.thresholds import ACCEPT
from rippletwin.twin.parameters import coordinates
from rippletwin.twin.twin import Twin

WIDENING, MAX_WIDENED_SD = 20.0, 0.3  # times the stated uncertainty, and at most (relative, or m)
RIVAL_MISFIT_RATIO = 2.0
"""Times the accepted misfit: a fit as good as this could be taken for the explanation; one whose
misfit is smaller by as much, what is below the model error aside, shows that it is none."""


@dataclass(frozen=True)
class WithoutEffect:
    """A fit without one effect, the data sheet being free.

    effect     name of what was left out
    evidence   log evidence lost with it, the data sheet as stated; None where nothing fits so
    misfit     relative, in sample, the data sheet free
    parameter  the line's parameter that goes furthest from the sheet
    value, nominal   its values, `unit`
    pull       how far that is, in standard deviations as stated
    rivals     whether the fit is nearly as good as the accepted one, or hardly any evidence is lost
    refutes    whether it is so much better, and so far from the sheet, that what is accepted cannot
               be what is missing
    """

    effect: str
    evidence: float | None
    misfit: float
    parameter: str
    value: float
    nominal: float
    unit: str
    pull: float
    rivals: bool
    refutes: bool


def compare_without_each_effect(
    pool: Workers, base: Fit, accepted: Fit
) -> tuple[WithoutEffect, ...]:
    """`WithoutEffect` of every accepted effect; the others stay. `base` is the fit without any.

    Each is first fitted with the sheet as stated, by continuation, which finds the valley; from
    there, and from where the accepted fit is, the sheet is let go.
    """
    rests = [accepted.without(k) for k in range(len(accepted.hypothesis))]
    held = [base]
    if len(rests) > 1:
        held = pool.fit(
            [{"hypothesis": r, "starts": [common_coordinates(accepted, r)]} for r in rests]
        )
    reached = score_fit(accepted, pool.observations).misfit
    found = []
    free = refit_with_wide_priors(pool, held, accepted)
    for (effect, _), stated, (misfit, fit) in zip(accepted.hypothesis, held, free):
        theta = coordinates(pool.base.parameters, fit.twin.values())
        pull, name = alarms.largest_pull(replace(fit, twin=pool.base.with_(theta=theta)))
        parameter = pool.base.parameters[pool.base.index[name]]
        lost = accepted.evidence - stated.evidence
        found.append(
            WithoutEffect(
                effect=effect.name,
                evidence=lost if np.isfinite(lost) else None,
                misfit=misfit,
                parameter=parameter.name,
                value=fit.twin.values()[parameter.name],
                nominal=parameter.nominal,
                unit=parameter.unit,
                pull=pull,
                rivals=misfit < RIVAL_MISFIT_RATIO * reached or lost < ACCEPT,
                refutes=pull > alarms.PULL_ALARM
                and RIVAL_MISFIT_RATIO * max(misfit, MIN_MODEL_ERROR) < reached,
            )
        )
    return tuple(found)


def refit_with_wide_priors(
    pool: Workers, held: Sequence[Fit], accepted: Fit
) -> list[tuple[float, Fit]]:
    """(misfit, fit) of each of `held` fitted again with a sheet that is hardly known, from where
    it is and from where `accepted` is: the one that misfits less, for that is what is asked."""
    jobs = []
    for fit in held:
        old = fit.twin
        base = Twin(
            widen_priors(old.rig),
            pool.observations,
            friction=old.friction,
            source_sd=old.source_sd,
            guessed_load=old.guessed_load,
            uncertain_pump=old.uncertain_pump,
        )
        parameters = base.with_(effects=fit.hypothesis).parameters
        job = {"base": base, "hypothesis": fit.hypothesis, "source_free": fit.source_free}
        jobs += [
            {**job, "theta": coordinates(parameters, twin.values())}
            for twin in (old, accepted.twin)
        ]
    found = [(score_fit(fit, pool.observations).misfit, fit) for fit in pool.fit(jobs)]
    return [min(pair, key=lambda f: f[0]) for pair in zip(found[::2], found[1::2])]


def widen_priors(rig: Rig) -> Rig:
    """The rig with LOOSER times the stated uncertainty, at most MOST, nowhere less than stated."""
    stated = {f.name: getattr(rig.uncertainty, f.name) for f in fields(Uncertainty)}
    free = {name: max(sd, min(WIDENING * sd, MAX_WIDENED_SD)) for name, sd in stated.items()}
    return replace(rig, uncertainty=Uncertainty(**free))
