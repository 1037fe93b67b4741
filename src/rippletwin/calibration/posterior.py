"""How likely the data are under a twin, with derivatives: `likelihood` for explaining.

The model of the errors is noise with a covariance C, a relative model error delta common to all
sensors, and the error of a nominal source, relative and along the prediction h, in two parts:

    E[e e^H] = C + (delta^2 m + lambda^2 n) I + (sigma^2 I + tau^2 K) o g h (g h)^H + s^2 h h^H

sigma is the part that differs from harmonic to harmonic, tau the part that is smooth in frequency,
as a wrong bulk modulus or port timing makes it where these are no parameters of the twin. Between
frequencies f and f' of recordings o and p

    K = [1 + (1 + f f'/f0^2) exp(-(f - f')^2/(2 l^2))] (1/2 + 1/2 [o = p]),     f0 = l = 1 kHz:

a part is the same at all frequencies, for the ripple's size may be wrong, a part grows with
frequency, for an error of timing is one of phase, and half of both is common to all operating
points, for it is the same pump that is modelled wrongly. A smooth error is what an effect
at the pump, friction or a hose may look like; without it their standard deviations would be several
times too small, and an effect at the pump would be named where only the ripple is wrong.

tau is what the residual says, but of one thing it says nothing: an error of the ripple's size that
all operating points share is taken up by the line's impedance, all segments alike. Displacement
fixes the mean flow and not the backflow, which makes most of a ripple and goes with the bulk
modulus. So a size common to all is uncertain by s = 3 % whatever tau is; without it the impedances
of concealed cases were off by 1 to 4 % and stated to 0.8 % (docs/explain.md). Where the bulk
modulus is a parameter of its own, 1 % is left to dead volumes, ports and leakage.

g >= 1 is the size of the nominal ripple about a harmonic over that of the harmonic itself: where
two parts of the ripple cancel, or 40 dB below the strongest harmonic, a few per cent of the parts
are a large part of the sum. n is the mean square over sensors of what an orifice's products of
harmonics make of the prediction; they are wrong by lambda, several times the harmonics' own error,
and come from the load and not along h.

Residuals are judged by the prediction and not by the data (a shrinking model would fit anything
else), the determinant is the data's (a shrinking model would gain by it).
Explaining adds a least delta, and the choice to be blind to the source: sigma infinite, which
projects its amplitude and phase out at every frequency. All observations stand side by side.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rippletwin.calibration.likelihood import comparable
from rippletwin.calibration.whitening import Whitening, smooth_basis, source_scale
from rippletwin.spectra.frequency_selection import select_below
from rippletwin.twin.forward_jacobian import STEP, DifferentiableForward

MIN_MODEL_ERROR = 0.004
"""Least relative model error. A twin of a real line is not better than this however small its
sensors' noise: harmonic means over a wandering speed, the orifice's exponent, the mesh."""

MODEL_ERRORS = np.geomspace(MIN_MODEL_ERROR, 1.5, 9)
SOURCE_SDS = np.array([0.01, 0.03, 0.1])
"""sigma is one of these: no pump model has a harmonic to better than 1 %, and the last is the
largest that is put down to the ripple."""
SMOOTH_SDS = np.array([0.01, 0.03, 0.1])  # the same for tau
SIZE_SD, SIZE_SD_OF_PUMP = 0.03, 0.01  # s, and s where the pump's numbers are parameters
PRODUCT_ERROR = 0.2  # lambda


class Posterior:
    """Data below a frequency and the twin that is to predict them.

    twin, observations   all observations have the rig's sensors, or are one input impedance
    max_frequency_hz     nothing above it is used
    source_free          blind to the source

    `floor`, `source_sd` and `smooth_sd` (delta, sigma, tau) are set by `estimate_errors`.
    """

    def __init__(self, twin, observations: Sequence, max_frequency_hz=None, source_free=False):
        self.twin = twin
        self.observations = [select_below(o, max_frequency_hz) for o in observations]
        self.forward = DifferentiableForward(twin, self.observations)
        self.source_free = source_free
        self.model_error, self.source_sd, self.smooth_sd = 0.1, float(SOURCE_SDS[1]), 0.0
        self.max_model_error, self._products = np.inf, 0.0
        self._size = SIZE_SD_OF_PUMP if twin.uncertain_pump else SIZE_SD
        self._known_for, self._known_determinant = None, 0.0
        self.prior = np.array([not p.flat for p in twin.parameters])
        data = [comparable(o, twin.rig) for o in self.observations]
        covariance = np.concatenate([o.covariance for o in data])
        variances, basis = np.linalg.eigh(covariance)
        self._variances = np.maximum(variances, 0.0).T  # (S, F)
        self._rotation = np.conj(basis)
        self.values = np.concatenate([o.values for o in data], axis=1)  # (S, F)
        self._rotated = self._rotate(self.values)
        self.power = np.mean(np.abs(self.values) ** 2, axis=0)  # (F,)
        known = [np.full(o.values.shape[1], o.source == "known") for o in data]
        free = [
            np.full(
                o.values.shape[1], o.source == "free" or (source_free and o.source == "nominal")
            )
            for o in data
        ]
        self._known, self._free = np.concatenate(known), np.concatenate(free)
        nominal = ~(self._known | self._free)
        self._nominal = np.flatnonzero(nominal)
        self._scale = np.ones(len(nominal))  # g
        for o, part in zip(data, self.forward.slices):
            if o.source == "nominal":
                self._scale[part] = source_scale(self.forward.source.flow[part])
        smooth = smooth_basis(self.forward.frequency_hz[nominal], self.forward.recording[nominal])
        size = np.ones((1, smooth.shape[1]))
        self._basis = np.concatenate([self._scale[nominal] * smooth, size])
        pairs = self._basis[:, None] * self._basis
        self._pairs = pairs.reshape(len(self._basis) ** 2, len(self._nominal)).T
        self.count = 2 * (self.values.size - int(np.sum(self._free)))
        self._pressures = all(o.kind != "input_impedance" for o in data)

    def predict(self, theta: np.ndarray) -> np.ndarray:
        """Predictions of all observations side by side, (S, F)."""
        return np.concatenate(self.forward(theta), axis=1)

    def is_valid(self, prediction: np.ndarray) -> bool:
        """Whether the last prediction is one: of a line without loss at its resonance it is
        infinite, and where much is stored no steady state may be found."""
        return self.forward.solved and bool(np.all(np.isfinite(prediction)))

    def objective(self, theta: np.ndarray, prediction: np.ndarray) -> float:
        """Minus the log posterior at the present errors, but for a constant, theta being what was
        predicted last; infinite where nothing `holds`."""
        if not self.is_valid(prediction):
            return np.inf
        r, log_determinant = self.whitened(prediction)
        prior = 0.5 * float(np.sum(theta[self.prior] ** 2))
        return prior + float(np.sum(np.abs(r) ** 2)) + log_determinant

    def whitened(self, prediction: np.ndarray) -> tuple[np.ndarray, float]:
        """Residuals (..., S, F) of unit variance and the log determinant of their covariance.

        A leading dimension of `prediction` is one of many predictions; the covariance is then
        the first one's.
        """
        metric = self._metric(prediction[(0,) * (prediction.ndim - 2)])
        r = metric.apply(self._rotated - self._rotate(prediction))
        return r, self._log_determinant()

    def _log_determinant(self) -> float:
        """Of the covariance that readings as large as the data have: a harmonic's error goes with
        the source's size as it was. Were it the prediction's, the determinant would reward one that
        is too small at all frequencies, of which the error of the size takes up the whole."""
        errors = self.model_error, self.source_sd, self.smooth_sd, np.sum(self._products)
        if errors != self._known_for:
            self._known_for, self._known_determinant = (
                errors,
                self._metric(self.values).log_determinant,
            )
        return self._known_determinant

    def _variance(self, floor) -> np.ndarray:
        """Of the readings, (..., S, F), but for the source's share."""
        return self._variances + self._products + floor**2 * self.power

    def _metric(self, prediction: np.ndarray) -> Whitening:
        """Whitening by the covariance that a prediction (S, F) implies."""
        return Whitening(
            self._rotate(prediction),
            np.sqrt(self._variance(self.model_error)),
            np.where(self._known, 0.0, np.where(self._free, np.inf, self.source_sd * self._scale)),
            self._nominal,
            self._sds(self.smooth_sd)[:, None] * self._basis,
        )

    def _sds(self, smooth_sd) -> np.ndarray:
        """Standard deviations (..., J) of the basis's amplitudes for tau (...)."""
        smooth = np.repeat(np.asarray(smooth_sd)[..., None], len(self._basis) - 1, axis=-1)
        return np.concatenate([smooth, np.full((*smooth.shape[:-1], 1), self._size)], axis=-1)

    def draw(self, prediction: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Values (S, F) that a twin of this prediction might have given, its errors drawn anew.

        A free source stays as strong as the data have it.
        """

        def normal(*shape):
            return (rng.normal(size=(*shape, 2)) @ np.array([1.0, 1j])) / np.sqrt(2.0)

        h = self.best_source(prediction)
        relative = np.where(self._known | self._free, 0.0, self.source_sd * self._scale)
        source = 1.0 + relative * normal(h.shape[1])
        sds = self._sds(self.smooth_sd)
        source[self._nominal] += (sds * normal(len(sds))) @ self._basis
        error = np.sqrt(self._variance(self.model_error)) * normal(*h.shape)
        return source * h + np.einsum("fsk,kf->sf", np.conj(self._rotation), error)

    def estimate_errors(self, prediction: np.ndarray, theta: np.ndarray) -> None:
        """Set floor and source errors to their most likely values given the residuals at theta.

        Degrees of freedom taken by the parameters are made up for by scaling the sum of squares.
        """
        taken = min(len(self.prior), 0.5 * self.count)
        scale = self.count / max(self.count - taken, 1.0)
        linear = self.forward.linear_load(theta)
        if linear is not None:
            self._products = PRODUCT_ERROR**2 * np.mean(np.abs(prediction - linear) ** 2, axis=0)
        h = self._rotate(prediction)
        squares, inner = np.abs(self._rotated - h) ** 2, np.conj(h) * (self._rotated - h)
        sizes = np.abs(h) ** 2
        floors = MODEL_ERRORS
        any_nominal = len(self._nominal) > 0
        sds = SOURCE_SDS if any_nominal else SOURCE_SDS[:1]
        taus = SMOOTH_SDS if any_nominal else np.zeros(1)
        for _ in range(2):
            weight = 1.0 / self._variance(floors[:, None, None])
            square = np.sum(squares * weight, axis=1)  # (D, F)
            cross = np.sum(inner * weight, axis=1)
            size = np.maximum(np.sum(sizes * weight, axis=1), 1e-300)
            stretch = (
                1.0 + np.where(self._known, 0.0, (self._scale * sds[:, None, None]) ** 2) * size
            )
            along = np.where(self._free, 1.0, 1.0 - 1.0 / stretch) * np.abs(cross) ** 2 / size
            logs = np.log(np.where(self._free, size, stretch))
            cost = np.sum(scale * (square - along) + logs, axis=2)
            cost = cost - np.sum(np.log(weight), axis=(1, 2)) + np.zeros((len(taus), 1, 1))
            if any_nominal:  # (T, G, D): what the smooth error of unit prior changes
                gain = 1.0 / stretch[..., self._nominal]
                gram = ((size[:, self._nominal] * gain) @ self._pairs).reshape(
                    *gain.shape[:2], len(self._basis), -1
                )
                share = (cross[:, self._nominal] * gain) @ self._basis.T  # (G, D, J)
                sizes_of = self._sds(taus)[:, None, None]  # (T, 1, 1, J)
                root = np.linalg.cholesky(
                    np.eye(len(self._basis)) + sizes_of[..., None] * gram * sizes_of[..., None, :]
                )
                both = np.stack([share.real, share.imag], axis=-1)
                solved = np.linalg.solve(root, sizes_of[..., None] * both)
                cost -= scale * np.sum(solved**2, axis=(-2, -1))
                cost += 2 * np.sum(np.log(np.diagonal(root, axis1=-2, axis2=-1)), axis=-1)
            smooth, source, best = np.unravel_index(np.argmin(cost), cost.shape)
            self.model_error = float(floors[best])
            self.source_sd, self.smooth_sd = float(sds[source]), float(taus[smooth])
            near = floors[max(best - 1, 0)], floors[min(best + 1, len(floors) - 1)]
            floors = np.geomspace(*near, 7)
            sds, taus = sds[source : source + 1], taus[smooth : smooth + 1]
        self.model_error = min(self.model_error, self.max_model_error)

    def use_full_jacobian(self, theta: np.ndarray) -> None:
        """From here on derivatives about theta know what the line stores beyond proportion."""
        if self._pressures and self.forward.has_nonlinear_compliance:
            self.forward.use_full_jacobian(theta)

    def linearise(self, theta: np.ndarray, prediction: np.ndarray, besides=None):
        """Residual r (N,) and its Jacobian J (N, P) at the present errors; the gradient of the
        `objective` is J^T r.

        Of the N residuals 2 S F are the whitened ones, of unit variance; theta follows where it
        has a prior. `besides` (B, S, F) are further directions in which the prediction may go,
        B more columns of the Jacobian.
        """
        if self._pressures:
            slopes = self.forward.derivatives(theta)
        else:
            moved = [self.predict(theta + STEP * e) for e in np.eye(len(theta))]
            slopes = (np.stack(moved) - prediction) / STEP
        if besides is not None:
            slopes = np.concatenate([slopes, besides])
        metric = self._metric(prediction)
        whitened = metric.apply(self._rotated - self._rotate(prediction))
        # The sum of squares is least over the source's error, so its gradient is that with the
        # source held at its most likely value, which every slope therefore carries.
        slopes = slopes * self._source(prediction, metric, whitened)
        columns = -_real(metric.apply(self._rotate(slopes))).reshape(len(slopes), -1)
        r = np.concatenate([_real(whitened).ravel(), theta[self.prior]])
        return r, np.concatenate([columns.T, np.eye(len(theta), len(slopes))[self.prior]])

    def best_source(self, prediction: np.ndarray) -> np.ndarray:
        """The prediction with every free source at its most likely amplitude, (S, F)."""
        return np.where(self._free, self._amplitude(prediction), 1.0) * prediction

    def _source(self, prediction, metric: Whitening, whitened: np.ndarray) -> np.ndarray:
        """Most likely source (F,) relative to the prediction's, given whitened residuals."""
        pull = np.sum(np.conj(self._rotate(prediction)) * metric.adjoint(whitened), axis=0)
        error = (self.source_sd * self._scale) ** 2 * pull
        sds = self._sds(self.smooth_sd)
        error[self._nominal] += self._basis.T @ (sds**2 * (self._basis @ pull[self._nominal]))
        return np.where(
            self._free, self._amplitude(prediction), 1.0 + np.where(self._known, 0.0, error)
        )

    def _amplitude(self, prediction: np.ndarray) -> np.ndarray:
        weight = 1.0 / self._variance(self.model_error)
        h = self._rotate(prediction)
        return np.sum(weight * np.conj(h) * self._rotated, 0) / np.maximum(
            np.sum(weight * np.abs(h) ** 2, 0), 1e-300
        )

    def _rotate(self, x: np.ndarray) -> np.ndarray:
        return np.einsum("fsk,...sf->...kf", self._rotation, x)


def _real(r: np.ndarray) -> np.ndarray:
    """Complex residuals of unit variance as real ones: each part has half the variance."""
    return np.sqrt(2.0) * np.stack([r.real, r.imag], axis=-3)
