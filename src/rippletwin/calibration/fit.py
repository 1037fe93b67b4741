"""A fitted twin with its evidence and covariance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from rippletwin.calibration.laplace import approximate_posterior
from rippletwin.calibration.likelihood import Likelihood
from rippletwin.calibration.posterior import Posterior
from rippletwin.twin.effects.base import Effect, Place
from rippletwin.twin.twin import Twin

HALF_INTERVAL = 1.96  # of 95 %, in standard deviations
Hypothesis = tuple[tuple[Effect, Place], ...]
"""Effects of a twin, each at its place; () is the line without any."""


@dataclass(frozen=True)
class Fit:
    """A fitted hypothesis.

    hypothesis    the effects and their places
    twin          at the mode of the posterior
    objective     minus the log posterior there
    evidence      log evidence by Laplace's approximation; hypotheses on the same data compare by it
    covariance    (P, P) of theta, by the same approximation
    model_error   estimated relative error of the twin
    source_sd     estimated relative error of the source, independent between harmonics
    smooth_sd     estimated relative error of the source, smooth in frequency
    source_free   whether the source was projected out
    plain         whether the error model was that of calibration (`likelihood`), without smooth
                  source errors, and not that of explaining (`posterior`)
    has_nonlinear_compliance   whether the line has a compliance that depends on the pressure
    expected_gain   what a Newton step promises to add to the log posterior; 0 at a stationary point
    interval_ends   lower and upper end of the 95 % interval of a parameter, by its index, in
                    theta's coordinates; only where a profile was traced (`profile_intervals`)
    """

    hypothesis: Hypothesis
    twin: Twin = field(repr=False)
    objective: float
    evidence: float
    covariance: np.ndarray = field(repr=False)
    model_error: float
    source_sd: float
    smooth_sd: float
    source_free: bool = False
    plain: bool = False
    has_nonlinear_compliance: bool = False
    expected_gain: float = 0.0
    interval_ends: Mapping[int, tuple[float, float]] = field(default_factory=dict, repr=False)

    @property
    def sd(self) -> np.ndarray:
        """(P,) posterior standard deviations in theta's coordinates."""
        return np.sqrt(np.diag(self.covariance))

    def interval(self, k: int) -> tuple[float, float]:
        """95 % interval of parameter k, in theta's coordinates."""
        reach = HALF_INTERVAL * self.sd[k]
        return self.interval_ends.get(k, (self.twin.theta[k] - reach, self.twin.theta[k] + reach))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects."""
        return tuple(effect.name for effect, _ in self.hypothesis)

    def without(self, k: int) -> Hypothesis:
        """The hypothesis without its effect k."""
        return self.hypothesis[:k] + self.hypothesis[k + 1 :]

    @property
    def label(self) -> str:
        """Effects and places in words; "" for the line without any."""
        return " + ".join(f"{effect.name}, {place}" for effect, place in self.hypothesis)


def conclude_fit(model: Posterior | Likelihood, hypothesis: Hypothesis, theta: np.ndarray) -> Fit:
    """The fit at a mode theta (P,), with its evidence and covariance.

    Where no start leads to a valid prediction, the evidence is minus infinity.
    """
    mode, twin = approximate_posterior(model, theta), model.twin.with_(theta=theta)
    if not np.isfinite(mode.evidence):
        return Fit(hypothesis, twin, np.inf, -np.inf, mode.covariance, np.inf, 0.0, 0.0)
    return Fit(
        hypothesis,
        twin,
        mode.objective,
        mode.evidence,
        mode.covariance,
        model.model_error,
        model.source_sd,
        model.smooth_sd,
        model.source_free,
        isinstance(model, Likelihood),
        model.forward.has_nonlinear_compliance,
        mode.expected_gain,
    )


def posterior_at_fit(
    fit: Fit, observations: Sequence, model_error: float | None = None
) -> Posterior:
    """The posterior at a fit, with errors that are independent from frequency to frequency.

    The smooth part of the source's error and that of its size are added to the independent part.

    model_error   by default that of the fit
    """
    posterior = Posterior(fit.twin, observations, None, fit.source_free)
    prediction = posterior.predict(fit.twin.theta)
    posterior.estimate_errors(prediction, fit.twin.theta)
    posterior.make_errors_independent(prediction)
    posterior.model_error = fit.model_error if model_error is None else model_error
    return posterior
