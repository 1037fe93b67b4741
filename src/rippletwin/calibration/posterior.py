"""Error model of explaining: smooth source errors, a least model error, derivatives.

The readings are d = S h + e. h is what the line makes of a nominal source, and S is the factor by
which the real source differs from it. e is noise with a covariance C and a relative model error
delta common to all sensors. At each frequency

    S = exp(eps) (1 + g w),

with two errors. w differs from harmonic to harmonic, with standard deviation sigma. eps is smooth
in frequency, as unstated relief grooves or free air, a wrong bulk modulus or port timing make it.
It is complex: an error of amplitude and of phase. Between frequencies f and f' of recordings o and
p its covariance is

    tau^2 [1 + (1 + f f'/f0^2) exp(-(f - f')^2/(2 l^2))] (1/2 + 1/2 [o = p]) + s^2, f0 = l = 1 kHz.

* One part is the same at all frequencies: the size of the ripple may be wrong.
* One part grows with frequency: an error of timing is an error of phase, and edges of ports that
  are less sharp than stated take most from the highest harmonics.
* Half of both is common to all operating points: the same pump is modelled wrongly.

eps stands in an exponent because a source is often several times smaller than the nominal one. Were
it a normal error of the nominal source, that would have to be large to allow for it, and the
likeliest line would be the one that makes of the nominal source the least ripple: with a pump's
volume that is too large, and a pipe before it that is too short.

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

S is expanded about the most likely smooth error, S = mean + factor (eps + g w), so that eps and w
are integrated out in closed form:

    d - mean h ~ N(0, C + (delta^2 m + lambda^2 n) I + (sigma^2 g^2 I + K) o p p^H),   p = factor h.

m is the mean square of the measured harmonic over the sensors, K the covariance of eps. The smooth
source and this covariance are held where the errors were estimated last, and a descent
estimates them after each step: iteratively reweighted least squares (Jorgensen 2012, Encyclopedia
of Environmetrics). A descent that could change the covariance would make the prediction small,
because that makes the errors of its source small. Explaining adds a least delta and the choice to
be source-free: sigma is infinite, which projects amplitude and phase of the source out at every
frequency. All observations stand side by side.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import NamedTuple

import numpy as np

from rippletwin.calibration.error_costs import error_costs
from rippletwin.calibration.error_model import ObservedRipple
from rippletwin.calibration.error_sizes import ErrorSizes, most_likely_sizes
from rippletwin.calibration.likelihood import to_predicted_quantity
from rippletwin.calibration.smooth_source import SmoothSourceError, SourceExpansion, source_scale
from rippletwin.calibration.source_expansion import (
    SourceData,
    most_likely_expansion,
    whiten_with_source,
)
from rippletwin.calibration.whitening import NoiseBasis, Whitening, as_real
from rippletwin.spectra.frequency_selection import select_below
from rippletwin.twin.forward_jacobian import STEP, DifferentiableForward

FIRST_SOURCE_SD = 0.03  # before any residual is known
SIZE_SD, SIZE_SD_OF_PUMP = 0.03, 0.01  # s, and s where the pump's numbers are parameters
PRODUCT_ERROR = 0.2  # lambda
TINY = 1e-300
SOURCE_STEPS = 8  # towards the most likely smooth error, before and after its size is estimated


class _Held(NamedTuple):
    """What a descent does not change between two estimates of the errors.

    prediction   (S, F), rotated: the covariance is that of it
    source       (F,) the most likely source over the nominal one
    offset       (S, F), rotated: expected readings less source times prediction
    """

    prediction: np.ndarray
    source: np.ndarray
    offset: np.ndarray


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
            SIZE_SD_OF_PUMP if twin.uncertain_pump else SIZE_SD,
        )
        # By which sigma is multiplied: nothing is unknown of a known source, all of a free one.
        self._source_scale = np.where(self._known, 0.0, np.where(self._free, np.inf, self._scale))
        self._expansion = self._smooth.without_error()
        self._held: _Held | None = None
        self._kept: tuple[ErrorSizes, Whitening] | None = None  # that covariance at some sizes
        self.count = 2 * (self.values.size - int(np.sum(self._free)))
        self._pressures = all(o.kind != "input_impedance" for o in data)

    def _set_values(self, values: np.ndarray) -> None:
        self.values = values
        self._rotated = self._rotate(values)
        self.power = np.mean(np.abs(values) ** 2, axis=0)

    def make_errors_independent(self, prediction: np.ndarray) -> None:
        """Add the smooth part of the source's error to the independent part, at a prediction."""
        self.source_sd = float(np.hypot(self.source_sd, self.smooth_sd))
        self.smooth_sd, self._expansion = 0.0, self._smooth.without_error()
        self._hold(prediction)

    def with_values(self, values: np.ndarray) -> Posterior:
        """The same error model, at the present errors, of other measured `values` (S, F), given in
        the quantity that is predicted. It shares the forward model."""
        other = copy(self)
        other._set_values(values)
        other._kept = None
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
        covariance is that where the errors were estimated last; before any estimate, that of the
        first prediction.
        """
        whitening = self._whitening(prediction[(0,) * (prediction.ndim - 2)])
        return whitening.apply(self._residual(prediction)), whitening.log_determinant

    def _residual(self, prediction: np.ndarray) -> np.ndarray:
        """Rotated readings less the expected ones, (..., S, F)."""
        h = self._rotate(prediction)
        if self._held is None:
            return self._rotated - self._expansion.mean * h
        return self._rotated - self._held.offset - self._held.source * h

    def _variance(self, model_error) -> np.ndarray:
        """Variance (..., S, F) of the readings without the share of the source."""
        return self._noise.variances + self._products + model_error**2 * self.power

    def _source_data(self, rotated_prediction: np.ndarray) -> SourceData:
        return SourceData(
            self._rotated,
            rotated_prediction,
            np.sqrt(self._variance(self.model_error)),
            self.source_sd * self._source_scale,
            self._smooth,
            self.smooth_sd,
        )

    def _whitening(self, prediction: np.ndarray) -> Whitening:
        """Whitening by the covariance that is held, or by that of a prediction (S, F)."""
        if self._held is None:
            data = self._source_data(self._rotate(prediction))
            return whiten_with_source(data, self._expansion)
        sizes = ErrorSizes(self.smooth_sd, self.source_sd, self.model_error)
        if self._kept is None or self._kept[0] != sizes:
            data = self._source_data(self._held.prediction)
            self._kept = sizes, whiten_with_source(data, self._expansion)
        return self._kept[1]

    def _hold(self, prediction: np.ndarray) -> None:
        """Hold source and covariance of a prediction (S, F)."""
        self._held = self._kept = None
        whitening, h = self._whitening(prediction), self._rotate(prediction)
        whitened = whitening.apply(self._residual(prediction))
        source = self._source(prediction, whitening, whitened, independent=False)
        self._held = _Held(h, source, (self._expansion.mean - source) * h)

    def draw(self, prediction: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Values (S, F) drawn from the error model around a prediction.

        A free source keeps its most likely amplitude.
        """

        def normal(*shape):
            return (rng.normal(size=(*shape, 2)) @ np.array([1.0, 1j])) / np.sqrt(2.0)

        h = self.best_source(prediction)
        relative = np.where(self._known | self._free, 0.0, self.source_sd * self._scale)
        sds = self._smooth.sds(self.smooth_sd)
        smooth = self._smooth.expand(sds * normal(len(sds)))
        source = smooth.mean + smooth.factor * self._smooth.error(smooth.amplitudes)
        source = source * (1.0 + relative * normal(h.shape[1]))
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
        self._held = self._kept = None
        if near:
            self._settle_errors(prediction, scale, 1)
        else:
            self._choose_errors(prediction, scale)
        self.model_error = min(self.model_error, self.max_model_error)
        self._hold(prediction)

    def _choose_errors(self, prediction: np.ndarray, scale: float) -> None:
        """Settle the errors from a source without a smooth error, and from what the readings alone
        suggest of it; the likelier ones are kept."""
        starts = [self._smooth.without_error()]
        if len(self._smooth.frequencies):
            starts.append(self._expansion_by_readings(prediction))
        found = []
        for start in starts:
            self._expansion = start
            self._estimate_sizes(prediction, scale, near=False)
            self._expand_source(prediction, SOURCE_STEPS)
            self._settle_errors(prediction, scale, SOURCE_STEPS)
            r, log_determinant = self.whitened(prediction)
            sizes = self.smooth_sd, self.source_sd, self.model_error
            cost = scale * float(np.sum(np.abs(r) ** 2)) + log_determinant
            found.append((cost, self._expansion, sizes))
        _, self._expansion, sizes = min(found, key=lambda each: each[0])
        self.smooth_sd, self.source_sd, self.model_error = sizes

    def _settle_errors(self, prediction: np.ndarray, scale: float, steps: int) -> None:
        self._estimate_sizes(prediction, scale, near=True)
        self._expand_source(prediction, steps)

    def _expansion_by_readings(self, prediction: np.ndarray) -> SourceExpansion:
        """The expansion about the smooth part of the source that the readings alone suggest."""
        variance = self._variance(self.model_error)
        size = np.sum(np.abs(self._rotate(prediction)) ** 2 / variance, axis=0)
        ratio = self._best_amplitude(prediction)
        own = np.maximum(size * np.abs(ratio) ** 2, TINY)
        return self._smooth.expand_near(ratio, 1.0 / own)

    def _expand_source(self, prediction: np.ndarray, steps: int) -> None:
        """Move the expansion to the most likely smooth error, in at most `steps` steps."""
        if len(self._smooth.frequencies):
            data = self._source_data(self._rotate(prediction))
            self._expansion = most_likely_expansion(data, self._expansion, steps)

    def _estimate_sizes(self, prediction: np.ndarray, scale: float, near: bool) -> None:
        """Set the sizes of the errors to their most likely values at the present expansion."""
        h, residual = self._rotate(prediction), self._residual(prediction)

        def costs(grids):
            taus, sds, model_errors = grids
            return error_costs(
                residual,
                h * self._expansion.factor,
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

        present = ErrorSizes(self.smooth_sd, self.source_sd, self.model_error)
        any_nominal = len(self._smooth.frequencies) > 0
        sizes = most_likely_sizes(costs, present, any_nominal, near)
        self.smooth_sd, self.source_sd, self.model_error = sizes

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
        """Derivatives (P, S, F) of the prediction at theta (P,)."""
        if self._pressures:
            return self.forward.derivatives(theta)
        moved = [self.predict(theta + STEP * e) for e in np.eye(len(theta))]
        return (np.stack(moved) - prediction) / STEP

    def whiten_slopes(
        self, prediction: np.ndarray, slopes: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Residual (2 S F,) and its derivatives (B, 2 S F) at the present errors, given those
        (B, S, F) of the prediction."""
        whitening = self._whitening(prediction)
        whitened = whitening.apply(self._residual(prediction))
        if self._held is None:
            source = self._source(prediction, whitening, whitened, independent=False)
        else:
            source = self._held.source
        columns = -as_real(whitening.apply(self._rotate(slopes * source)))
        return as_real(whitened).ravel(), columns.reshape(len(slopes), -1)

    def best_source(self, prediction: np.ndarray) -> np.ndarray:
        """The prediction with every free source at its most likely amplitude, (S, F)."""
        return self._with_free_amplitudes(np.ones(len(self.power)), prediction) * prediction

    def most_likely_source(self, prediction: np.ndarray) -> np.ndarray:
        """Most likely source (F,) relative to that of the prediction, at the present errors."""
        whitening = self._whitening(prediction)
        return self._source(prediction, whitening, whitening.apply(self._residual(prediction)))

    def _source(
        self, prediction, whitening: Whitening, whitened: np.ndarray, independent: bool = True
    ) -> np.ndarray:
        """Most likely source (F,) relative to that of the prediction, given whitened residuals.

        independent   whether with its error that is independent from harmonic to harmonic
        """
        expansion = self._expansion
        h = self._rotate(prediction) * expansion.factor
        pull = np.sum(np.conj(h) * whitening.adjoint(whitened), axis=0)
        error = self._smooth.error(self._smooth.most_likely(pull, self.smooth_sd))
        if independent:
            error += np.where(self._known, 0.0, (self.source_sd * self._scale) ** 2 * pull)
        source = expansion.mean + expansion.factor * error
        return self._with_free_amplitudes(source, prediction)

    def _with_free_amplitudes(self, source: np.ndarray, prediction: np.ndarray) -> np.ndarray:
        """`source` (F,), with that of a free source at its most likely amplitude."""
        if not self._free.any():
            return source
        return np.where(self._free, self._best_amplitude(prediction), source)

    def _best_amplitude(self, prediction: np.ndarray) -> np.ndarray:
        """Factor (F,) of the source at each frequency with which a prediction fits best."""
        weight, h = 1.0 / self._variance(self.model_error), self._rotate(prediction)
        size = np.maximum(np.sum(weight * np.abs(h) ** 2, axis=0), TINY)
        return np.sum(weight * np.conj(h) * self._rotated, axis=0) / size

    def _rotate(self, x: np.ndarray) -> np.ndarray:
        return self._noise.rotate(x)
