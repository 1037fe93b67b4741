"""Error model of explaining: smooth source errors, a least model error, derivatives.

The errors are noise with a covariance C, a relative model error delta common to all sensors, and
the error of a nominal source, relative and along the prediction h, in two parts:

    E[e e^H] = C + (delta^2 m + lambda^2 n) I + (sigma^2 I + tau^2 K) o g h (g h)^H + s^2 h h^H

m is the mean square of the measured harmonic over the sensors. sigma is the part of the source's
error that differs from harmonic to harmonic. tau is the part that is smooth in frequency, as a
wrong bulk modulus or port timing makes it where these are no parameters of the twin. Between
frequencies f and f' of recordings o and p

    K = [1 + (1 + f f'/f0^2) exp(-(f - f')^2/(2 l^2))] (1/2 + 1/2 [o = p]),     f0 = l = 1 kHz.

* One part is the same at all frequencies: the size of the ripple may be wrong.
* One part grows with frequency: an error of timing is an error of phase.
* Half of both is common to all operating points: the same pump is modelled wrongly.

A smooth error resembles an effect at the pump, friction or a hose. Without tau the standard
deviations of those effects would be several times too small, and an effect at the pump would be
named where only the ripple is wrong.

The residual determines tau, with one exception. An error of the ripple's size that is common to all
operating points is absorbed by the impedance of the line, all segments alike: displacement fixes
the mean flow, but not the backflow, which makes most of a ripple and goes with the bulk modulus. So
a size common to all is uncertain by s = 3 % whatever tau is. Without s the stated standard
deviations of the impedances would be several times too small. Where the bulk modulus is a parameter
of its own, s = 1 % is left for dead volumes, ports and leakage.

g >= 1 is the size of the nominal ripple around a harmonic over that of the harmonic itself. Where
two parts of the ripple cancel, or 40 dB below the strongest harmonic, a few per cent of the parts
are a large part of the sum.

n is the mean square over the sensors of what an orifice's products of harmonics contribute to the
prediction. They are wrong by lambda, several times more than the harmonics themselves, and come
from the load and not along h.

The covariance is that of the prediction, in the sum of squares and in the log determinant. With the
data in its place in the first a shrinking model would fit anything. With the data in its place in
the second the likeliest prediction would be too large, by the factor 1 + sigma^2 where the source's
error is all there is. Explaining adds a least delta and the choice to be source-free: sigma is
infinite, which projects amplitude and phase of the source out at every frequency. All observations
stand side by side.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from functools import lru_cache

import numpy as np

from rippletwin.calibration.error_costs import error_costs
from rippletwin.calibration.error_model import ObservedRipple
from rippletwin.calibration.likelihood import to_predicted_quantity
from rippletwin.calibration.smooth_source import SmoothSourceError, source_scale
from rippletwin.calibration.whitening import NoiseBasis, Whitening, as_real
from rippletwin.spectra.frequency_selection import select_below
from rippletwin.twin.forward_jacobian import STEP, DifferentiableForward

MIN_MODEL_ERROR = 0.004
"""Least relative model error. However small the noise, no twin of a real line is better: the speed
wanders while harmonics are averaged, the orifice's exponent is not exactly 1/2, a mesh is finite.
"""

MODEL_ERRORS = np.geomspace(MIN_MODEL_ERROR, 1.5, 9)
SOURCE_SDS = np.array([0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0])
"""Values of sigma. Relief grooves and free air that a data sheet does not state change a ripple by
20 to 80 % (docs/explanation/pump.md). The least is below what any pump model reaches: a sigma that
is larger than the truth would make the likeliest prediction too small."""
SMOOTH_SDS = np.array([0.003, 0.01, 0.03, 0.1, 0.3])  # values of tau
FIRST_SOURCE_SD = 0.03  # before any residual is known
FINER_ERRORS = 7  # values between two neighbours of a grid
SIZE_SD, SIZE_SD_OF_PUMP = 0.03, 0.01  # s, and s where the pump's numbers are parameters
PRODUCT_ERROR = 0.2  # lambda

DETERMINANT_OFFSET = 50.0
"""A frequency, added to the log determinant to make it half a square. It is above what a free
source takes away, and leaves the curvature to the other residuals."""


class Posterior:
    """Log posterior of a twin with smooth source errors; see `ErrorModel` for the methods.

    twin, observations   all observations have the rig's sensors, or are one input impedance
    max_frequency_hz     nothing above it is used
    source_free          whether the source is projected out of all observations

    `model_error`, `source_sd` and `smooth_sd` (delta, sigma, tau) are set by `estimate_errors`.
    `values` (S, F) are the measured values of all observations side by side, `power` (F,) is m.
    """

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
        self.source_free = source_free
        self.model_error, self.source_sd, self.smooth_sd = 0.1, FIRST_SOURCE_SD, 0.0
        self.max_model_error, self._products = np.inf, 0.0
        self.prior = np.array([not p.flat for p in twin.parameters])
        data = [to_predicted_quantity(o, twin.rig) for o in self.observations]
        self._noise = NoiseBasis(np.concatenate([o.covariance for o in data]))
        self._set_values(np.concatenate([o.values for o in data], axis=1))
        sources = np.repeat([o.source for o in data], [o.values.shape[1] for o in data])
        self._known = sources == "known"
        self._free = (sources == "free") | (source_free & (sources == "nominal"))
        nominal = ~(self._known | self._free)
        self._scale = np.ones(len(nominal))  # g
        for o, part in zip(data, self.forward.slices):
            if o.source == "nominal":
                self._scale[part] = source_scale(self.forward.source.flow[part])
        self._smooth = SmoothSourceError(
            self.forward.frequency_hz,
            self.forward.recording,
            nominal,
            self._scale,
            SIZE_SD_OF_PUMP if twin.uncertain_pump else SIZE_SD,
        )
        # By which sigma is multiplied: nothing is unknown of a known source, all of a free one.
        self._source_scale = np.where(self._known, 0.0, np.where(self._free, np.inf, self._scale))
        self.count = 2 * (self.values.size - int(np.sum(self._free)))
        self._pressures = all(o.kind != "input_impedance" for o in data)

    def _set_values(self, values: np.ndarray) -> None:
        self.values = values
        self._rotated = self._rotate(values)
        self.power = np.mean(np.abs(values) ** 2, axis=0)

    def with_values(self, values: np.ndarray) -> Posterior:
        """The same error model, at the present errors, of other measured `values` (S, F), given in
        the quantity that is predicted. It shares the forward model."""
        other = copy(self)
        other._set_values(values)
        return other

    def below(self, max_frequency_hz: float) -> Posterior:
        """The same error model of the data at and below a frequency."""
        return Posterior(self.twin, self.observations, max_frequency_hz, self.source_free)

    def predict(self, theta: np.ndarray) -> np.ndarray:
        """Predictions of all observations side by side, (S, F)."""
        return np.concatenate(self.forward(theta), axis=1)

    def by_observation(self, prediction: np.ndarray) -> list[ObservedRipple]:
        """Measurement and prediction, one observation at a time."""
        return [
            ObservedRipple(self.values[:, part], prediction[:, part], self.power[part])
            for part in self.forward.slices
        ]

    def is_valid(self, prediction: np.ndarray) -> bool:
        """Whether the last prediction is finite and its nonlinear equations were solved.

        That of a line without loss is infinite at its resonance. With a strong nonlinear compliance
        no steady state may be found.
        """
        return self.forward.solved and bool(np.all(np.isfinite(prediction)))

    def objective(self, theta: np.ndarray, prediction: np.ndarray) -> float:
        """Minus the log posterior at the present errors but for a constant; inf if not valid.

        prediction   that of theta, the last that was made
        """
        if not self.is_valid(prediction):
            return np.inf
        r, log_determinant = self.whitened(prediction)
        prior = 0.5 * float(np.sum(theta[self.prior] ** 2))
        return prior + float(np.sum(np.abs(r) ** 2)) + log_determinant

    def whitened(self, prediction: np.ndarray) -> tuple[np.ndarray, float]:
        """Residuals (..., S, F) of unit variance and the log determinant of their covariance.

        Leading dimensions of `prediction` (..., S, F) are those of many predictions. The
        covariance then is that of the first.
        """
        whitening = self._whitening(prediction[(0,) * (prediction.ndim - 2)])
        return whitening.apply(self._rotated - self._rotate(prediction)), whitening.log_determinant

    def constant_log_determinant(self) -> float:
        """What of the log determinant does not depend on the prediction; it is in no residual of
        `linearise`."""
        offset = DETERMINANT_OFFSET * len(self.power)
        return float(np.sum(np.log(self._variance(self.model_error)))) - offset

    def _variance(self, model_error) -> np.ndarray:
        """Variance (..., S, F) of the readings without the share of the source."""
        return self._noise.variances + self._products + model_error**2 * self.power

    def _whitening(self, prediction: np.ndarray) -> Whitening:
        """Whitening by the covariance that a prediction (S, F) implies."""
        return Whitening(
            self._rotate(prediction),
            np.sqrt(self._variance(self.model_error)),
            self.source_sd * self._source_scale,
            self._smooth.frequencies,
            self._smooth.sds(self.smooth_sd)[:, None] * self._smooth.basis,
        )

    def draw(self, prediction: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Values (S, F) drawn from the error model around a prediction.

        A free source keeps its most likely amplitude.
        """

        def normal(*shape):
            return (rng.normal(size=(*shape, 2)) @ np.array([1.0, 1j])) / np.sqrt(2.0)

        h = self.best_source(prediction)
        relative = np.where(self._known | self._free, 0.0, self.source_sd * self._scale)
        source = 1.0 + relative * normal(h.shape[1])
        sds = self._smooth.sds(self.smooth_sd)
        source[self._smooth.frequencies] += (sds * normal(len(sds))) @ self._smooth.basis
        error = np.sqrt(self._variance(self.model_error)) * normal(*h.shape)
        return source * h + np.einsum("fsk,kf->sf", np.conj(self._noise.rotation), error)

    def estimate_errors(
        self, prediction: np.ndarray, theta: np.ndarray, near: bool = False
    ) -> None:
        """Set model error and source errors to their most likely values given the residuals.

        The sum of squares is scaled up for the degrees of freedom that the parameters take. With
        `near` only values next to the present ones are tried: on the way of a descent they move
        little from step to step.
        """
        taken = min(len(self.prior), 0.5 * self.count)
        scale = self.count / max(self.count - taken, 1.0)
        linear = self.forward.linear_load(theta)
        if linear is not None:
            self._products = PRODUCT_ERROR**2 * np.mean(np.abs(prediction - linear) ** 2, axis=0)
        h = self._rotate(prediction)
        any_nominal = len(self._smooth.frequencies) > 0
        grids = [
            SMOOTH_SDS if any_nominal else np.zeros(1),
            SOURCE_SDS if any_nominal else SOURCE_SDS[:1],
            MODEL_ERRORS,
        ]
        errors = [self.smooth_sd, self.source_sd, self.model_error]
        if near:
            grids = [_neighbours(grid, value) for grid, value in zip(grids, errors)]
        best = self._likeliest_errors(h, grids, scale)
        errors = [float(grid[k]) for grid, k in zip(grids, best)]
        for axis in (2, 1, 0):  # then each alone, between its neighbours on the grid
            finer = [np.array([value]) for value in errors]
            finer[axis] = _between_neighbours(grids[axis], best[axis])
            errors[axis] = float(finer[axis][self._likeliest_errors(h, finer, scale)[axis]])
        self.smooth_sd, self.source_sd, self.model_error = errors
        self.model_error = min(self.model_error, self.max_model_error)

    def _likeliest_errors(self, h: np.ndarray, grids: Sequence, scale: float) -> tuple[int, ...]:
        """Indices of the likeliest tau, sigma and delta of three `grids`."""
        taus, sds, model_errors = grids
        cost = error_costs(
            self._rotated - h,
            h,
            self._noise.variances + self._products,
            self.power,
            self._source_scale,
            self._smooth.frequencies,
            self._smooth.basis,
            model_errors,
            sds,
            self._smooth.sds(taus),
            scale,
        )
        return tuple(int(k) for k in np.unravel_index(np.argmin(cost), cost.shape))

    @property
    def needs_full_jacobian(self) -> bool:
        """Whether derivatives with a frozen compliance end a descent too far from the mode."""
        return self._pressures and self.forward.has_nonlinear_compliance

    def use_full_jacobian(self, theta: np.ndarray) -> None:
        """From here on derivatives near theta include those of the nonlinear compliance."""
        if self.needs_full_jacobian:
            self.forward.use_full_jacobian(theta)

    def linearise(self, theta: np.ndarray, prediction: np.ndarray, besides=None):
        """Residual r (N,) and its Jacobian J (N, P) at the present errors.

        The first 2 S F residuals are the whitened ones, of unit variance. The next is that of the
        log determinant. theta follows where it has a prior. The gradient of the `objective` is
        J^T r, and half the square sum is the objective without `constant_log_determinant`.

        besides   (B, S, F) further directions of the prediction, B more columns of the Jacobian
        """
        slopes = self.slopes(theta, prediction)
        if besides is not None:
            slopes = np.concatenate([slopes, besides])
        r, columns = self.whiten_slopes(prediction, slopes)
        r = np.concatenate([r, theta[self.prior]])
        return r, np.concatenate([columns.T, np.eye(len(theta), len(slopes))[self.prior]])

    def slopes(self, theta: np.ndarray, prediction: np.ndarray) -> np.ndarray:
        """Derivatives (P, S, F) of the prediction at theta (P,)."""
        if self._pressures:
            return self.forward.derivatives(theta)
        moved = [self.predict(theta + STEP * e) for e in np.eye(len(theta))]
        return (np.stack(moved) - prediction) / STEP

    def whiten_slopes(
        self, prediction: np.ndarray, slopes: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Residual (2 S F + 1,) and its derivatives (B, 2 S F + 1) at the present errors, given
        those (B, S, F) of the prediction.

        The last residual is sqrt(2 L + const), L the part of the log determinant that depends on
        the prediction: half its square is L.
        """
        whitening = self._whitening(prediction)
        whitened = whitening.apply(self._rotated - self._rotate(prediction))
        # The sum of squares is the least over the error of the source. Its gradient therefore is
        # that with the source fixed at its most likely value, which multiplies every derivative.
        moved = slopes * self._source(prediction, whitening, whitened)
        columns = -as_real(whitening.apply(self._rotate(moved))).reshape(len(slopes), -1)
        offset = DETERMINANT_OFFSET * len(self.power)
        last = np.sqrt(2.0 * (whitening.source_log_determinant + offset))
        last_column = whitening.determinant_slopes(self._rotate(slopes)) / last
        residual = np.append(as_real(whitened).ravel(), last)
        return residual, np.column_stack([columns, last_column])

    def best_source(self, prediction: np.ndarray) -> np.ndarray:
        """The prediction with every free source at its most likely amplitude, (S, F)."""
        return self._with_free_amplitudes(np.ones(len(self.power)), prediction) * prediction

    def most_likely_source(self, prediction: np.ndarray) -> np.ndarray:
        """Most likely source (F,) relative to that of the prediction, at the present errors."""
        whitening = self._whitening(prediction)
        whitened = whitening.apply(self._rotated - self._rotate(prediction))
        return self._source(prediction, whitening, whitened)

    def _source(self, prediction, whitening: Whitening, whitened: np.ndarray) -> np.ndarray:
        """Most likely source (F,) relative to that of the prediction, given whitened residuals."""
        pull = np.sum(np.conj(self._rotate(prediction)) * whitening.adjoint(whitened), axis=0)
        error = (self.source_sd * self._scale) ** 2 * pull
        error[self._smooth.frequencies] += self._smooth.most_likely(pull, self.smooth_sd)
        source = 1.0 + np.where(self._known, 0.0, error)
        return self._with_free_amplitudes(source, prediction)

    def _with_free_amplitudes(self, source: np.ndarray, prediction: np.ndarray) -> np.ndarray:
        """`source` (F,), with that of a free source at its most likely amplitude."""
        if not self._free.any():
            return source
        weight = 1.0 / self._variance(self.model_error)
        h = self._rotate(prediction)
        amplitude = np.sum(weight * np.conj(h) * self._rotated, 0) / np.maximum(
            np.sum(weight * np.abs(h) ** 2, 0), 1e-300
        )
        return np.where(self._free, amplitude, source)

    def _rotate(self, x: np.ndarray) -> np.ndarray:
        return self._noise.rotate(x)


def _neighbours(grid: np.ndarray, value: float) -> np.ndarray:
    """The values of an ascending grid next to `value`: the nearest, one below and one above."""
    distances = np.abs(np.log(np.maximum(grid, 1e-9) / max(value, 1e-9)))
    nearest = int(np.argmin(np.round(distances, 9)))  # rounding does not decide half way
    return grid[max(nearest - 1, 0) : nearest + 2]


def _between_neighbours(grid: np.ndarray, k: int) -> np.ndarray:
    """Finer values of an ascending grid between the neighbours of its entry `k`."""
    if len(grid) == 1:
        return grid
    return _finer_values(float(grid[max(k - 1, 0)]), float(grid[min(k + 1, len(grid) - 1)]))


@lru_cache(maxsize=256)
def _finer_values(low: float, high: float) -> np.ndarray:
    return np.geomspace(low, high, FINER_ERRORS)
