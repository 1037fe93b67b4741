"""Calibration: the twin's parameters from healthy recordings (inverse transient analysis).

All parameters are fitted by continuation in frequency (`frequency_continuation`) under the error
model of `likelihood`. Explaining does the same under that of `posterior`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from rippletwin.calibration.error_model import ErrorModel
from rippletwin.calibration.frequency_continuation import (
    LIMITS_HZ,
    continuation_limits,
    fit_by_continuation,
)
from rippletwin.calibration.laplace import UNCONVERGED_GAIN, Mode, approximate_posterior
from rippletwin.calibration.likelihood import EVENNESS, Likelihood
from rippletwin.calibration.misfit import Misfit, measure_misfit
from rippletwin.calibration.shaft_angles import fit_shaft_angles
from rippletwin.spectra.frequency_selection import check_load_table, check_sources
from rippletwin.twin.twin import Twin
from rippletwin.twin.unknown_load import LoadCurve, load_curve

UNDETERMINED_SD = 0.7  # posterior over prior standard deviation above which data say little
IMPLAUSIBLE_PULL = 3.0  # prior standard deviations
BAD_MISFIT = 0.1  # relative misfit after calibration
ANGLE_SD = 0.1  # rad; a shaft angle that is less well known is not determined


@dataclass(frozen=True)
class Settings:
    """Settings of a calibration.

    limits_hz          frequency limits of the continuation
    max_frequency_hz   data above it are not used; None for all
    """

    limits_hz: tuple[float, ...] = LIMITS_HZ
    max_frequency_hz: float | None = None


DEFAULTS = Settings()


@dataclass(frozen=True)
class Calibration:
    """A calibrated twin and how well it is known.

    twin          with `theta` at the mode of the posterior
    nominal       the twin before, with its shaft angles aligned with the recordings
    covariance    (P, P) of theta, by Laplace's approximation
    model_error   estimated relative error of the twin
    source_sd     estimated relative error of nominal sources
    objective     minus the log posterior at the mode
    before, after misfits of `nominal` and of `twin`
    warnings      in plain words
    observations  those that were fitted
    """

    twin: Twin
    nominal: Twin
    covariance: np.ndarray
    model_error: float
    source_sd: float
    objective: float
    before: Misfit
    after: Misfit
    warnings: tuple[str, ...] = field(default=())
    observations: tuple = field(default=(), repr=False)

    @property
    def sd(self) -> np.ndarray:
        """(P,) posterior standard deviations in theta's coordinates: 1 is the prior's."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def load(self) -> LoadCurve | None:
        """What the calibrated load reflects where the data sheet does not say; None where it
        does."""
        return load_curve(self.twin, self.covariance, self.observations)


def calibrate(
    twin: Twin,
    observations: Sequence,
    settings: Settings = DEFAULTS,
    progress: Callable[[str], None] | None = None,
) -> Calibration:
    """Fit all parameters of `twin` to `observations`, from the data sheet; deterministic.

    progress   is called with a sentence after each frequency limit

    Raises ValueError without observations, InputError as `check_sources` and `check_load_table`.
    """
    if not observations:
        raise ValueError("calibration needs at least one observation")
    check_sources(observations)
    model = Likelihood(twin, observations, settings.max_frequency_hz, evenness=EVENNESS)
    check_load_table(model.observations, twin.rig)

    def report(limit: float, fits: int, part: ErrorModel, theta: np.ndarray) -> None:
        best = measure_misfit(part, theta).relative
        progress(f"below {limit:.0f} Hz: {fits} starts, best misfit {best:.2%}")

    model, theta = fit_by_continuation(
        model,
        exact=True,
        limits_hz=settings.limits_hz,
        progress=None if progress is None else report,
    )
    return conclude(model, theta, settings)


def conclude(model: Likelihood, theta: np.ndarray, settings: Settings = DEFAULTS) -> Calibration:
    """The calibration at a mode theta (P,).

    The shaft angles of the nominal twin are fitted below the first limit.
    """
    twin = model.twin
    mode = approximate_posterior(model, theta)
    fitted, after = twin.with_(theta=theta), measure_misfit(model, theta)
    first = continuation_limits(model.observations, settings.limits_hz)[0]
    nominal = fit_shaft_angles(model.below(first), twin.theta)
    return Calibration(
        twin=fitted,
        nominal=twin.with_(theta=nominal),
        covariance=mode.covariance,
        model_error=model.model_error,
        source_sd=model.source_sd,
        objective=mode.objective,
        before=measure_misfit(model, nominal),
        after=after,
        warnings=_warnings(fitted, mode, after),
        observations=tuple(model.observations),
    )


def _warnings(twin: Twin, mode: Mode, after: Misfit) -> tuple[str, ...]:
    out = []
    if not after.relative < BAD_MISFIT:
        out.append(
            f"bad fit: {100 * after.relative:.0f} % of what was measured is left over after "
            "calibration; the model lacks physics, or the data sheet is wrong"
        )
    if not np.isfinite(mode.expected_gain):
        out.append(
            "no steady state of the line was found at the fitted values, and nothing of the fit "
            "holds; check load pressure and flow ripple in rig.yaml"
        )
    elif mode.expected_gain > UNCONVERGED_GAIN:
        out.append(
            f"not converged: one more step promises {mode.expected_gain:.1f} of log posterior"
        )
    sd = np.sqrt(np.diag(mode.covariance))
    for p, u, s in zip(twin.parameters, twin.theta, sd):
        value, value_sd = float(p.value(u)), p.value_sd(u, s)
        if p.flat:
            if value_sd > ANGLE_SD:
                out.append(f"{p.name} is not determined by the data")
            continue
        if p.prior.scale == 0.0 or not p.stated:
            continue  # exact by the data sheet, or not on it
        if abs(u) > IMPLAUSIBLE_PULL:
            out.append(
                f"{p.name} is implausible: {value:.4g} {p.unit} is {abs(u):.1f} standard "
                f"deviations from the data sheet's {p.nominal:.4g} {p.unit}"
            )
        if s > UNDETERMINED_SD:
            out.append(
                f"{p.name} is not determined by the data: known to {value_sd:.2g} {p.unit}, "
                f"{100 * s:.0f} % of what the data sheet already says"
            )
    return tuple(out)
