"""The interface between an error model and the optimiser.

An error model says how likely data are, given the prediction of a twin. There are two:
`rippletwin.calibration.likelihood.Likelihood` of calibration and
`rippletwin.calibration.posterior.Posterior` of explaining. The optimiser, the continuation in
frequency, the alignment of shaft angles and the starts know nothing but this interface.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol, Self

import numpy as np

Prediction = Any
"""What `ErrorModel.predict` returns. Only the same error model reads it."""


class ObservedRipple(NamedTuple):
    """One observation beside its prediction.

    measured, predicted   (S, F) complex
    power                 (F,) mean square that the relative model error refers to
    """

    measured: np.ndarray
    predicted: np.ndarray
    power: np.ndarray


class ErrorModel(Protocol):
    """Log posterior of a twin's parameters theta (P,) given observations.

    twin, observations   the observations as used, those below the frequency limit
    forward              `DifferentiableForward` of both; it can freeze the nonlinear compliance
    prior                (P,) mask of the parameters that have a prior N(0, 1)
    source_free          whether the source is projected out of all observations
    needs_full_jacobian  whether fast derivatives may end a descent too far from the mode
    errors_follow        whether errors that are estimated `near` the present ones depend on these
    model_error          relative error of the twin, set by `estimate_errors`
    max_model_error      the largest that `estimate_errors` sets
    """

    twin: Any
    observations: list
    forward: Any
    prior: np.ndarray
    source_free: bool
    errors_follow: bool
    model_error: float
    max_model_error: float

    @property
    def needs_full_jacobian(self) -> bool:
        """Whether a descent needs the exact derivatives of `use_full_jacobian`."""

    def below(self, max_frequency_hz: float) -> Self:
        """The same error model of the data at and below a frequency, Hz."""

    def predict(self, theta: np.ndarray) -> Prediction:
        """Predictions of all observations at theta (P,)."""

    def predict_speeds(self, thetas: np.ndarray) -> Sequence[Prediction]:
        """`predict` at `thetas` (N, P), which differ in wave speeds alone; what is nonlinear is as
        solved at the first."""

    def by_observation(self, prediction: Prediction) -> list[ObservedRipple]:
        """Measurement and prediction, one observation at a time."""

    def is_valid(self, prediction: Prediction) -> bool:
        """Whether the last prediction is finite and its nonlinear equations were solved."""

    def estimate_errors(
        self, prediction: Prediction, theta: np.ndarray, near: bool = False
    ) -> None:
        """Set the relative sizes of the errors to their most likely values.

        With `near` values next to the present ones suffice.
        """

    def follow_source(self, prediction: Prediction) -> None:
        """Set what else is estimated of the source beside the sizes of its errors."""

    def objective(self, theta: np.ndarray, prediction: Prediction) -> float:
        """Minus the log posterior at theta (P,) but for a constant; infinite if not valid."""

    def linearise(self, theta: np.ndarray, prediction: Prediction) -> tuple[np.ndarray, np.ndarray]:
        """Whitened residual r (N,) with unit variances and its Jacobian J (N, P).

        The gradient of the sum of squares is J^T r.
        """

    def use_full_jacobian(self, theta: np.ndarray) -> None:
        """From here on derivatives near theta (P,) are exact there, at a cost."""
