"""Error model of calibration: noise, a relative model error, an uncertain source.

At each frequency the values v (S,) of the sensors and the prediction h have the residual
e = v - h with

    E[e e^H] = C + delta^2 m I + sigma^2 h h^H,     m = (1 - g) |v|^2 + g mean_f |v|^2.

* C is the covariance of the observation.
* delta is the relative model error. It is estimated. |v|^2 is the mean over sensors, mean_f the
  mean over frequencies. The evenness g says whether delta is relative to each harmonic (0) or to
  the whole ripple (1).
* sigma is the relative error of the source, common to all sensors. It is zero for a known source
  and is estimated up to `twin.source_sd` for a nominal flow ripple. It is infinite for a free
  source: the amplitude of the source is then projected out. Its term is built from the
  prediction: with the data in its place a prediction that is too small would be rewarded.

Errors of different frequencies are independent. Errors of explaining are not: `posterior`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from rippletwin.calibration.error_costs import error_costs
from rippletwin.calibration.error_model import ObservedRipple
from rippletwin.calibration.whitening import (
    NO_BASIS,
    NO_FREQUENCIES,
    NoiseBasis,
    Whitening,
    as_real,
)
from rippletwin.spectra.frequency_selection import select_below
from rippletwin.twin.forward_jacobian import STEP, DifferentiableForward
from rippletwin.twin.reflection import stated_unit, to_reflection

EVENNESS = 0.5
"""Evenness g with which `calibrate` works. Where physics is missing, the weak upper harmonics are
wholly wrong. With an error relative to each harmonic they would weigh as much as the strong lower
ones."""

FIRST_MODEL_ERROR = 0.1  # relative, before it is estimated
MODEL_ERRORS = np.geomspace(1e-4, 2.0, 13)  # of the first search, which two finer ones follow
FINER_MODEL_ERRORS = 9
SOURCE_SHARES = np.array([0.0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 1.0])
"""Of the largest source error, `twin.source_sd`: the values tried for sigma."""


class Likelihood:
    """Log posterior of a twin with independent errors; see `ErrorModel` for the methods.

    Parameters
    ----------
    twin, observations : see rippletwin.twin.twin and rippletwin.spectra.observation.
    max_frequency_hz : use nothing above it; None for all.
    evenness : g above.

    Of periodic recordings the multiples of the number of pistons are used: a healthy nominal pump
    makes no other shaft orders.

    Attributes: `model_error` and `source_sd` (delta and sigma of nominal sources) are set by
    `estimate_errors`; `count` is the number of real data; `observations` are those used.
    """

    source_free, smooth_sd, errors_follow = False, 0.0, False
    needs_full_jacobian = True
    """Derivatives that freeze the nonlinear load are wrong by up to 2 %. The model error may be far
    less, and then a descent by them ends too far from the mode."""

    def __init__(
        self,
        twin,
        observations: Sequence,
        max_frequency_hz: float | None = None,
        evenness: float = 0.0,
    ):
        self.twin, self._evenness = twin, evenness
        pistons = twin.rig.pump.get("pistons", 1)
        self.observations = [select_below(o, max_frequency_hz, pistons) for o in observations]
        self.forward = DifferentiableForward(twin, self.observations)
        self.model_error, self.source_sd = FIRST_MODEL_ERROR, 0.0
        self.max_model_error = np.inf
        self.prior = np.array([not p.flat for p in twin.parameters])
        data = [to_predicted_quantity(o, twin.rig) for o in self.observations]
        impedance = [o.kind == "input_impedance" for o in data]
        self._members = [np.flatnonzero(np.equal(impedance, which)) for which in (False, True)]
        self._members = [members for members in self._members if len(members)]
        self._groups = [_Group([data[k] for k in m], evenness) for m in self._members]
        self._pressures = not any(impedance)
        self._use_quotients = not self._pressures
        self.count = 2 * sum(g.values.size - int(np.sum(g.free)) for g in self._groups)

    def below(self, max_frequency_hz: float) -> Likelihood:
        """The same error model of the data at and below a frequency, Hz."""
        return Likelihood(self.twin, self.observations, max_frequency_hz, self._evenness)

    def predict(self, theta: np.ndarray) -> list[np.ndarray]:
        """Predictions (S, F) at theta (P,): pressures of all observations side by side, Pa, then
        reflection coefficients."""
        predicted = self.forward(theta)
        return [np.concatenate([predicted[k] for k in m], axis=1) for m in self._members]

    def predict_speeds(self, thetas: np.ndarray) -> list[list[np.ndarray]]:
        """`predict` at `thetas` (N, P), which differ in wave speeds alone; what is nonlinear is as
        solved at the first."""
        if not self._pressures:
            return [self.predict(theta) for theta in thetas]
        return [[h] for h in np.concatenate(self.forward.predict_side_by_side(thetas), axis=2)]

    def by_observation(self, prediction: Sequence[np.ndarray]) -> list[ObservedRipple]:
        """Measurement and prediction (S, F), one observation at a time."""
        parts: list[ObservedRipple | None] = [None] * len(self.observations)
        for members, group, h in zip(self._members, self._groups, prediction):
            for k, part in zip(members, group.slices):
                parts[k] = ObservedRipple(group.values[:, part], h[:, part], group.power[part])
        return parts

    def is_valid(self, prediction: Sequence[np.ndarray]) -> bool:
        """Whether the last prediction is finite and its nonlinear equations were solved."""
        return self.forward.solved and all(np.all(np.isfinite(h)) for h in prediction)

    def objective(self, theta: np.ndarray, prediction: Sequence[np.ndarray]) -> float:
        """Minus the log posterior at theta (P,) and the present errors but for a constant; inf
        where the prediction is not valid."""
        if not self.is_valid(prediction):
            return np.inf
        total = 0.5 * float(np.sum(theta[self.prior] ** 2))
        for group, h in zip(self._groups, prediction):
            whitening = group.whitening(h, self.model_error, self.source_sd)
            total += float(np.sum(np.abs(whitening.apply(group.residual(h))) ** 2))
            total += whitening.log_determinant
        return total

    def residual(self, theta: np.ndarray, prediction: Sequence[np.ndarray]) -> np.ndarray:
        """Whitened residuals (N,) of unit variance, then theta where it has a prior.

        Half the sum of squares is minus the log posterior but for the log determinant.
        """
        parts = []
        for group, h in zip(self._groups, prediction):
            whitening = group.whitening(h, self.model_error, self.source_sd)
            parts.append(as_real(whitening.apply(group.residual(h))).ravel())
        return np.concatenate([*parts, theta[self.prior]])

    def linearise(
        self, theta: np.ndarray, prediction: Sequence[np.ndarray]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Residual (N,) and its Jacobian (N, P) at the present errors.

        The sum of squares is the least over the error of the source. Its gradient therefore is
        that with the source fixed at its most likely value, which multiplies every derivative.
        """
        residuals, columns = [], []
        for group, h, slopes in zip(self._groups, prediction, self._slopes(theta, prediction)):
            whitening = group.whitening(h, self.model_error, self.source_sd)
            whitened = whitening.apply(group.residual(h))
            slopes = slopes * group.best_source(
                h, whitening.adjoint(whitened), self.model_error, self.source_sd
            )
            changes = -as_real(whitening.apply(group.noise.rotate(slopes)))
            residuals.append(as_real(whitened).ravel())
            columns.append(changes.reshape(len(theta), -1).T)
        jacobian = np.concatenate([*columns, np.eye(len(theta))[self.prior]])
        return np.concatenate([*residuals, theta[self.prior]]), jacobian

    def estimate_errors(
        self, prediction: Sequence[np.ndarray], theta: np.ndarray, near: bool = False
    ) -> None:
        """Set model error and source error, both relative, to their most likely values given the
        residuals of a prediction at theta (P,).

        The sum of squares is scaled up for the degrees of freedom that the parameters take.
        """
        taken = min(len(self.prior), 0.5 * self.count)
        scale = self.count / max(self.count - taken, 1.0)
        model_errors, sigmas = MODEL_ERRORS, self.twin.source_sd * SOURCE_SHARES
        for _ in range(3):
            cost: np.ndarray = sum(
                (
                    group.cost(h, model_errors, sigmas, scale)
                    for group, h in zip(self._groups, prediction)
                ),
                np.zeros(()),
            )
            best, source = np.unravel_index(np.argmin(cost), cost.shape)
            self.model_error, self.source_sd = float(model_errors[best]), float(sigmas[source])
            low, high = max(int(best) - 1, 0), min(int(best) + 1, len(model_errors) - 1)
            model_errors = np.geomspace(model_errors[low], model_errors[high], FINER_MODEL_ERRORS)
            sigmas = sigmas[source : source + 1]
        self.model_error = min(self.model_error, self.max_model_error)

    def follow_source(self, prediction: Sequence[np.ndarray]) -> None:
        """Nothing: an error of the source is integrated out at every prediction."""

    def use_full_jacobian(self, theta: np.ndarray) -> None:
        """From here on derivatives near theta (P,) have those of nonlinear load and compliance."""
        if self._pressures and self.forward.has_nonlinear_compliance:
            self.forward.use_full_jacobian(theta)
        else:
            self._use_quotients = True

    def _slopes(self, theta: np.ndarray, prediction: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Derivatives of the predictions, list of (P, S, F)."""
        if not self._use_quotients:
            return [self.forward.derivatives(theta)]
        moved = [self.predict(theta + STEP * unit) for unit in np.eye(len(theta))]
        return [(np.stack(hs) - h) / STEP for hs, h in zip(zip(*moved), prediction)]


class _Group:
    """Values (S, F) of observations of one quantity side by side.

    power       (F,) m, of each observation for itself
    free        (F,) mask of the frequencies whose source is free; `nominal` likewise
    """

    def __init__(self, observations: Sequence, evenness: float):
        sizes = np.cumsum([0, *(len(o.frequency_hz) for o in observations)])
        self.slices = [slice(a, b) for a, b in pairwise(sizes)]
        self.values = np.concatenate([o.values for o in observations], axis=1)
        self.noise = NoiseBasis(np.concatenate([o.covariance for o in observations]))
        self._rotated = self.noise.rotate(self.values)
        self.power = np.mean(np.abs(self.values) ** 2, axis=0)
        for part in self.slices:
            own = self.power[part]
            self.power[part] = (1.0 - evenness) * own + evenness * np.mean(own)
        sources = np.repeat([o.source for o in observations], np.diff(sizes))
        self.free, self.nominal = sources == "free", sources == "nominal"

    def variance(self, model_error) -> np.ndarray:
        """Variance (..., S, F) of noise and model error (...)."""
        return self.noise.variances + model_error**2 * self.power

    def residual(self, prediction: np.ndarray) -> np.ndarray:
        """Residual (S, F) in the eigenbasis of the noise."""
        return self._rotated - self.noise.rotate(prediction)

    def whitening(self, prediction: np.ndarray, model_error: float, sigma: float) -> Whitening:
        """Whitening by the covariance that a prediction (S, F) implies."""
        source = np.where(self.free, np.inf, np.where(self.nominal, sigma, 0.0))
        return Whitening(self.noise.rotate(prediction), np.sqrt(self.variance(model_error)), source)

    def best_source(self, prediction, pull, model_error: float, sigma: float) -> np.ndarray:
        """Most likely source (F,) relative to that of the prediction (S, F).

        pull   (S, F) residual multiplied by the inverse covariance
        """
        h = self.noise.rotate(prediction)
        source = 1.0 + np.where(self.nominal, sigma**2, 0.0) * np.sum(np.conj(h) * pull, axis=0)
        if not np.any(self.free):
            return source
        weight = 1.0 / self.variance(model_error)
        size = np.maximum(np.sum(weight * np.abs(h) ** 2, axis=0), 1e-300)
        amplitude = np.sum(weight * np.conj(h) * self._rotated, axis=0) / size
        return np.where(self.free, amplitude, source)

    def cost(self, prediction, model_errors, sigmas, scale) -> np.ndarray:
        """Minus log likelihood (D, G) of model errors (D,) and source errors sigmas (G,).

        The squares are multiplied by `scale`.
        """
        source = np.where(self.free, np.inf, np.where(self.nominal, 1.0, 0.0))
        return error_costs(
            self.residual(prediction),
            self.noise.rotate(prediction),
            self.noise.variances,
            self.power,
            source,
            NO_FREQUENCIES,
            NO_BASIS,
            model_errors,
            sigmas,
            np.empty((1, 0)),
            scale,
        )[0].T


def to_predicted_quantity(observation, rig):
    """The observation in the quantity that `ForwardModel` predicts.

    An input impedance becomes a reflection coefficient (see `twin.reflection`), its
    covariance with it: dR = 2 dz/(z + 1)^2 with z over the data sheet's rho a/A. The rest stays.
    """
    if observation.kind != "input_impedance":
        return observation
    unit = stated_unit(observation, rig)
    z = observation.values / unit
    slope = np.abs(2.0 / (z[0] + 1.0) ** 2) ** 2 / unit**2
    return replace(
        observation,
        values=to_reflection(z),
        covariance=observation.covariance * slope[:, None, None],
    )
