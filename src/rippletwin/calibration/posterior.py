"""Log posterior of a twin with the errors of `reading_errors`, and its derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy

import numpy as np

from rippletwin.calibration.error_model import ObservedRipple
from rippletwin.calibration.likelihood import to_predicted_quantity
from rippletwin.calibration.reading_errors import (
    SIZE_SD,
    SIZE_SD_OF_PUMP,
    ReadingErrors,
    Sources,
)
from rippletwin.calibration.smooth_source import SmoothSourceError, source_scale
from rippletwin.calibration.whitening import NoiseBasis, as_real
from rippletwin.spectra.frequency_selection import select_below
from rippletwin.twin.forward_jacobian import STEP, DifferentiableForward

PRODUCT_ERROR = 0.2  # lambda of `reading_errors`


class Posterior:
    """Log posterior of a twin with smooth source errors; see `ErrorModel` for the methods.

    twin, observations   all observations have the rig's sensors, or are one input impedance
    max_frequency_hz     nothing above it is used
    source_free          whether the source is projected out of all observations

    `model_error`, `source_sd` and `smooth_sd` (delta, sigma, tau) are set by `estimate_errors`.
    `values` (S, F) are the measured values of all observations side by side, `power` (F,) is m.
    """

    errors_follow = True

    def __init__(
        self,
        twin,
        observations: Sequence,
        max_frequency_hz: float | None = None,
        source_free: bool = False,
    ):
        self.twin = twin
        self.observations = [select_below(o, max_frequency_hz) for o in observations]
        self.forward = DifferentiableForward(twin, self.observations)
        self.source_free, self.max_model_error = source_free, np.inf
        self.prior = np.array([not p.flat for p in twin.parameters])
        data = [to_predicted_quantity(o, twin.rig) for o in self.observations]
        self._noise = NoiseBasis(np.concatenate([o.covariance for o in data]))
        self.values = np.concatenate([o.values for o in data], axis=1)
        self.power = _mean_square(self.values)
        sources = self._sources(data)
        self._errors = ReadingErrors(self._rotate(self.values), self.power, self._noise, sources)
        self.count = 2 * (self.values.size - int(np.sum(sources.free)))
        self._pressures = all(o.kind != "input_impedance" for o in data)

    def _sources(self, data: Sequence) -> Sources:
        """What the observations say of the source at each frequency."""
        kinds = np.repeat([o.source for o in data], [o.values.shape[1] for o in data])
        known = kinds == "known"
        free = (kinds == "free") | (self.source_free & (kinds == "nominal"))
        scale = np.ones(len(kinds))
        for o, part in zip(data, self.forward.slices):
            if o.source == "nominal":
                scale[part] = source_scale(self.forward.source.flow[part])
        size_sd = SIZE_SD_OF_PUMP if self.twin.uncertain_pump else SIZE_SD
        frequency_hz, recording = self.forward.frequency_hz, self.forward.recording
        smooth = SmoothSourceError(frequency_hz, recording, ~(known | free), size_sd)
        return Sources(known, free, scale, smooth)

    @property
    def model_error(self) -> float:
        """delta: error of the model, relative to each measured harmonic's rms over the sensors."""
        return self._errors.sizes.model

    @model_error.setter
    def model_error(self, value: float) -> None:
        self._errors.sizes = self._errors.sizes._replace(model=value)

    @property
    def source_sd(self) -> float:
        """sigma: relative error of the source, independent from frequency to frequency."""
        return self._errors.sizes.source

    @source_sd.setter
    def source_sd(self, value: float) -> None:
        self._errors.sizes = self._errors.sizes._replace(source=value)

    @property
    def smooth_sd(self) -> float:
        """tau: relative error of the source, smooth in frequency."""
        return self._errors.sizes.smooth

    @smooth_sd.setter
    def smooth_sd(self, value: float) -> None:
        self._errors.sizes = self._errors.sizes._replace(smooth=value)

    def make_errors_independent(self, prediction: np.ndarray) -> None:
        """Add the smooth part of the source's error to the independent part.

        prediction   (S, F) at which that is done
        """
        self._errors.make_independent(self._rotate(prediction))

    def with_values(self, values: np.ndarray) -> Posterior:
        """The same error model, at the present errors, of other measured `values` (S, F), given in
        the quantity that is predicted. It shares the forward model."""
        other = copy(self)
        other.values, other.power = values, _mean_square(values)
        other._errors = self._errors.with_values(self._rotate(values), other.power)
        return other

    def below(self, max_frequency_hz: float) -> Posterior:
        """The same error model of the data at and below a frequency, Hz."""
        return Posterior(self.twin, self.observations, max_frequency_hz, self.source_free)

    def predict(self, theta: np.ndarray) -> np.ndarray:
        """Predictions of all observations side by side, (S, F), at theta (P,): pressures in Pa, or
        reflection coefficients."""
        return np.concatenate(self.forward(theta), axis=1)

    def predict_speeds(self, thetas: np.ndarray) -> list[np.ndarray]:
        """`predict` at `thetas` (N, P), which differ in wave speeds alone; what is nonlinear is as
        solved at the first."""
        if not self._pressures:
            return [self.predict(theta) for theta in thetas]
        return list(np.concatenate(self.forward.predict_side_by_side(thetas), axis=2))

    def predict_held(self, theta: np.ndarray) -> np.ndarray:
        """`predict` with everything nonlinear as it was solved last."""
        return np.concatenate(self.forward.predict_held(theta), axis=1)

    def by_observation(self, prediction: np.ndarray) -> list[ObservedRipple]:
        """Measurement and prediction (S, F), one observation at a time."""
        return [
            ObservedRipple(self.values[:, part], prediction[:, part], self.power[part])
            for part in self.forward.slices
        ]

    def is_valid(self, prediction: np.ndarray) -> bool:
        """Whether the last prediction (S, F) is finite and its nonlinear equations were solved.

        That of a line without loss is infinite at its resonance. With a strong nonlinear compliance
        no steady state may be found.
        """
        return self.forward.solved and bool(np.all(np.isfinite(prediction)))

    def objective(self, theta: np.ndarray, prediction: np.ndarray) -> float:
        """Minus the log posterior at the present errors but for a constant; inf if not valid.

        prediction   (S, F) that of theta (P,), the last that was made
        """
        if not self.is_valid(prediction):
            return np.inf
        r, log_determinant = self.whitened(prediction)
        prior = 0.5 * float(np.sum(theta[self.prior] ** 2))
        return prior + float(np.sum(np.abs(r) ** 2)) + log_determinant

    def whitened(self, prediction: np.ndarray) -> tuple[np.ndarray, float]:
        """Residuals (..., S, F) of unit variance and the log determinant of their covariance.

        Leading dimensions of `prediction` (..., S, F) are those of many predictions. The
        covariance is that where the errors were estimated last; before any estimate, that of the
        first prediction.
        """
        h = self._rotate(prediction)
        whitening = self._errors.whitening(h[(0,) * (h.ndim - 2)])
        return whitening.apply(self._errors.residual(h)), whitening.log_determinant

    def draw(self, prediction: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Values (S, F), in the unit of the data, drawn from the error model around a prediction.

        A free source keeps its most likely amplitude.
        """

        def normal(*shape):
            return (rng.normal(size=(*shape, 2)) @ np.array([1.0, 1j])) / np.sqrt(2.0)

        h = self.best_source(prediction) * self._errors.draw_source(normal)
        error = np.sqrt(self._errors.variance()) * normal(*h.shape)
        return h + np.einsum("fsk,kf->sf", np.conj(self._noise.rotation), error)

    def estimate_errors(
        self, prediction: np.ndarray, theta: np.ndarray, near: bool = False
    ) -> None:
        """Set model error and source errors to their most likely values given the residuals that a
        prediction (S, F) at theta (P,) leaves.

        The sum of squares is scaled up for the degrees of freedom that the parameters take. With
        `near` only values next to the present ones are tried: on the way of a descent they move
        little from step to step.
        """
        taken = min(len(self.prior), 0.5 * self.count)
        scale = self.count / max(self.count - taken, 1.0)
        linear = self.forward.linear_load(theta)
        if linear is not None:
            products = self.forward.amplitude * (prediction - linear)
            self._errors.products = PRODUCT_ERROR**2 * _mean_square(products)
        self._errors.estimate(self._rotate(prediction), scale, near, self.max_model_error)

    def follow_source(self, prediction: np.ndarray) -> None:
        """Set the most likely source to that of a prediction (S, F); sizes of the errors stay."""
        self._errors.follow(self._rotate(prediction))

    @property
    def needs_full_jacobian(self) -> bool:
        """Whether derivatives with a frozen compliance end a descent too far from the mode."""
        return self._pressures and self.forward.has_nonlinear_compliance

    def use_full_jacobian(self, theta: np.ndarray) -> None:
        """From here on derivatives near theta (P,) include those of the nonlinear compliance."""
        if self.needs_full_jacobian:
            self.forward.use_full_jacobian(theta)

    def linearise(self, theta: np.ndarray, prediction: np.ndarray, besides=None):
        """Residual r (N,) and its Jacobian J (N, P) at the present errors.

        The first 2 S F residuals are the whitened ones, of unit variance. theta follows where it
        has a prior. Half the square sum is the objective without the log determinant.

        besides   (B, S, F) further directions of the prediction, B more columns of the Jacobian
        """
        slopes = self.slopes(theta, prediction)
        if besides is not None:
            slopes = np.concatenate([slopes, besides])
        r, columns = self.whiten_slopes(prediction, slopes)
        r = np.concatenate([r, theta[self.prior]])
        return r, np.concatenate([columns.T, np.eye(len(theta), len(slopes))[self.prior]])

    def slopes(self, theta: np.ndarray, prediction: np.ndarray) -> np.ndarray:
        """Derivatives (P, S, F) of the prediction (S, F) by the coordinates theta (P,)."""
        if self._pressures:
            return self.forward.derivatives(theta)
        moved = [self.predict(theta + STEP * e) for e in np.eye(len(theta))]
        return (np.stack(moved) - prediction) / STEP

    def whiten_slopes(
        self, prediction: np.ndarray, slopes: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Residual (2 S F,) and its derivatives (B, 2 S F) at the present errors, given those
        (B, S, F) of the prediction."""
        h = self._rotate(prediction)
        whitening = self._errors.whitening(h)
        residual = as_real(whitening.apply(self._errors.residual(h))).ravel()
        moved = self._rotate(slopes * self._errors.smooth_source(h))
        return residual, -as_real(whitening.apply(moved)).reshape(len(slopes), -1)

    def best_source(self, prediction: np.ndarray) -> np.ndarray:
        """The prediction with every free source at its most likely amplitude, (S, F)."""
        return self.free_amplitudes(prediction) * prediction

    def free_amplitudes(self, prediction: np.ndarray) -> np.ndarray:
        """Most likely amplitude (F,) of every free source, over that of the prediction (S, F); 1 of
        any other."""
        return self._errors.free_amplitudes(self._rotate(prediction))

    def most_likely_source(self, prediction: np.ndarray) -> np.ndarray:
        """Most likely source (F,) relative to that of the prediction, at the present errors."""
        return self._errors.most_likely_source(self._rotate(prediction))

    def _rotate(self, x: np.ndarray) -> np.ndarray:
        return self._noise.rotate(x)


def _mean_square(x: np.ndarray) -> np.ndarray:
    """Mean square (F,) over the sensors of x (S, F)."""
    return np.mean(np.abs(x) ** 2, axis=0)
