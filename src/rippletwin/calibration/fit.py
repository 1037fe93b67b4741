"""A fitted twin with its Laplace evidence and covariance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from rippletwin.calibration.levenberg_marquardt import hessian
from rippletwin.calibration.posterior import Posterior
from rippletwin.twin.effects.base import Effect, Place
from rippletwin.twin.twin import Twin


def posterior_at_fit(fit: Fit, observations: Sequence, floor: float | None = None) -> Posterior:
    """The fit's likelihood with errors that are independent from frequency to frequency.

    The source's error, smooth part and the rest, is put into each frequency alone. `floor` is the
    model error, by default the fit's own.
    """
    posterior = Posterior(fit.twin, observations, None, fit.source_free)
    posterior.estimate_errors(posterior.predict(fit.twin.theta), fit.twin.theta)
    posterior.source_sd = float(np.hypot(posterior.source_sd, posterior.smooth_sd))
    posterior.smooth_sd = 0.0
    posterior.model_error = fit.model_error if floor is None else floor
    return posterior


Hypothesis = tuple[tuple[Effect, Place], ...]
"""The effects that a twin has, each at its place; () is the paper's line."""


@dataclass(frozen=True)
class Fit:
    """A hypothesis fitted.

    twin         at the posterior mode
    objective    minus the log posterior there
    evidence     Laplace's log evidence, comparable between hypotheses on the same data
    covariance   (P, P) of theta
    floor, source_sd, smooth_sd   estimated relative errors (see `Posterior`)
    source_free  which of the two likelihoods
    stores       whether the line stores something beyond proportion to the pressure
    ends         of parameters, by index: the ends of their 95 % intervals in theta's coordinates,
                 where more is known of them than the covariance (`profile_intervals`)
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
    has_nonlinear_compliance: bool = False
    interval_ends: Mapping[int, tuple[float, float]] = field(default_factory=dict, repr=False)

    @property
    def sd(self) -> np.ndarray:
        """(P,) posterior standard deviations in theta's coordinates."""
        return np.sqrt(np.diag(self.covariance))

    def interval(self, k: int) -> tuple[float, float]:
        """95 % interval of parameter k, in theta's coordinates."""
        reach = 1.96 * self.sd[k]
        return self.interval_ends.get(k, (self.twin.theta[k] - reach, self.twin.theta[k] + reach))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects."""
        return tuple(effect.name for effect, _ in self.hypothesis)

    def without(self, k: int) -> Hypothesis:
        """The hypothesis but for its effect k."""
        return self.hypothesis[:k] + self.hypothesis[k + 1 :]

    @property
    def label(self) -> str:
        """Effects and places in words; "" of the paper's line."""
        return " + ".join(f"{effect.name}, {place}" for effect, place in self.hypothesis)


def laplace_fit(posterior: Posterior, hypothesis: Hypothesis, theta: np.ndarray) -> Fit:
    """The fit at a mode: evidence and covariance."""
    prediction, twin = posterior.predict(theta), posterior.twin.with_(theta=theta)
    if not posterior.is_valid(prediction):
        # No start leads anywhere: the hypothesis says nothing of these data.
        unknown = np.eye(len(theta))
        return Fit(hypothesis, twin, np.inf, -np.inf, unknown, np.inf, 0.0, 0.0)
    posterior.estimate_errors(prediction, theta)
    objective = posterior.objective(theta, prediction)
    second = hessian(posterior, theta, prediction)
    log_det = np.linalg.slogdet(second)[1]
    return Fit(
        hypothesis,
        twin,
        objective,
        -objective - 0.5 * log_det,
        np.linalg.inv(second),
        posterior.model_error,
        posterior.source_sd,
        posterior.smooth_sd,
        posterior.source_free,
        posterior.forward.has_nonlinear_compliance,
    )
