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

import numpy as np

from rippletwin.calibration.error_model import ObservedRipple
from rippletwin.calibration.whitening import NoiseBasis, Whitening, as_real
from rippletwin.spectra.frequency_selection import select_below
from rippletwin.twin.forward_jacobian import STEP, DifferentiableForward
from rippletwin.twin.forward_model import characteristic_impedance, reflection

MODEL_ERRORS = np.geomspace(1e-4, 2.0, 40)
SOURCE_SHARES = np.array([0.0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 1.0])
"""Of the largest source error, `twin.source_sd`: the values tried for sigma."""


class Likelihood:
    """Log posterior of a twin with independent errors; see `ErrorModel` for the methods.

    Parameters
    ----------
    twin, observations : see rippletwin.twin.twin and rippletwin.spectra.observation.
    max_frequency_hz : use nothing above it; None for all.
    model_error : relative model error delta to begin with.
    piston_orders : use only multiples of the number of pistons of periodic recordings. A healthy
        nominal pump makes no other shaft orders.
    evenness : g above.

    Attributes: `model_error` and `source_sd` (delta and sigma of nominal sources) are set by
    `estimate_errors`; `count` is the number of real data; `observations` are those used.
    """

    source_free = False

    def __init__(
        self,
        twin,
        observations: Sequence,
        max_frequency_hz: float | None = None,
        model_error: float = 0.1,
        piston_orders: bool = True,
        evenness: float = 0.0,
    ):
        self.twin = twin
        self._settings = {"piston_orders": piston_orders, "evenness": evenness}
        pistons = twin.rig.pump.get("pistons", 1) if piston_orders else 1
        self.observations = [select_below(o, max_frequency_hz, pistons) for o in observations]
        self.forward = DifferentiableForward(twin, self.observations)
        self.model_error, self.source_sd = model_error, 0.0
        self.max_model_error = np.inf
        self.prior = np.array([not p.flat for p in twin.parameters])
        data = [comparable(o, twin.rig) for o in self.observations]
        self._data = [_Observed(o, evenness) for o in data]
        self._pressures = all(o.kind != "input_impedance" for o in data)
        free = sum(d.values.shape[1] for d in self._data if d.source == "free")
        self.count = 2 * (sum(d.values.size for d in self._data) - free)

    def below(self, max_frequency_hz: float) -> Likelihood:
        """The same error model of the data at and below a frequency."""
        return Likelihood(self.twin, self.observations, max_frequency_hz, **self._settings)

    def predict(self, theta: np.ndarray) -> list[np.ndarray]:
        """Predictions of the observations, list of (S, F)."""
        return self.forward(theta)

    def by_observation(self, prediction: Sequence[np.ndarray]) -> list[ObservedRipple]:
        """Measurement and prediction, one observation at a time."""
        return [ObservedRipple(d.values, h, d.power) for d, h in zip(self._data, prediction)]

    def is_valid(self, prediction: Sequence[np.ndarray]) -> bool:
        """Whether the last prediction is finite and its nonlinear equations were solved."""
        return self.forward.solved and all(np.all(np.isfinite(h)) for h in prediction)

    def objective(self, theta: np.ndarray, prediction: Sequence[np.ndarray]) -> float:
        """Minus the log posterior at the present errors but for a constant; inf if not valid."""
        if not self.is_valid(prediction):
            return np.inf
        total = 0.5 * float(np.sum(theta[self.prior] ** 2))
        for d, h in zip(self._data, prediction):
            whitening = self._whitening(d, h)
            total += float(np.sum(np.abs(whitening.apply(d.residual(h))) ** 2))
            total += whitening.log_determinant
        return total

    def residual(self, theta: np.ndarray, prediction: Sequence[np.ndarray]) -> np.ndarray:
        """Whitened residuals (N,) of unit variance, then theta where it has a prior.

        Half the sum of squares is minus the log posterior but for the log determinant.
        """
        parts = [
            as_real(self._whitening(d, h).apply(d.residual(h))).ravel()
            for d, h in zip(self._data, prediction)
        ]
        return np.concatenate([*parts, theta[self.prior]])

    def linearise(
        self, theta: np.ndarray, prediction: Sequence[np.ndarray]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Residual (N,) and its Jacobian (N, P) at the present errors.

        The sum of squares is the least over the error of the source. Its gradient therefore is
        that with the source fixed at its most likely value, which multiplies every derivative.
        """
        columns = []
        for d, h, slopes in zip(self._data, prediction, self._slopes(theta, prediction)):
            whitening = self._whitening(d, h)
            slopes = slopes * self._best_source(d, h, whitening)
            whitened = -as_real(whitening.apply(d.noise.rotate(slopes)))
            columns.append(whitened.reshape(len(slopes), -1).T)
        jacobian = np.concatenate([*columns, np.eye(len(theta))[self.prior]])
        return self.residual(theta, prediction), jacobian

    def estimate_errors(self, prediction: Sequence[np.ndarray], theta: np.ndarray) -> None:
        """Set model error and source error to their most likely values given the residuals.

        The sum of squares is scaled up for the degrees of freedom that the parameters take.
        """
        taken = min(len(self.prior), 0.5 * self.count)
        scale = self.count / (self.count - taken)
        sigmas = self.twin.source_sd * SOURCE_SHARES
        model_errors = MODEL_ERRORS
        for _ in range(2):
            cost = np.zeros((len(model_errors), len(sigmas)))
            for d, h in zip(self._data, prediction):
                cost += d.cost(h, model_errors, sigmas, scale)
            best, source = np.unravel_index(np.argmin(cost), cost.shape)
            self.model_error, self.source_sd = float(model_errors[best]), float(sigmas[source])
            # Once more, finely, around the best.
            ends = [max(best - 1, 0), min(best + 1, len(model_errors) - 1)]
            model_errors = np.geomspace(*model_errors[ends], 12)
        self.model_error = min(self.model_error, self.max_model_error)

    def use_full_jacobian(self, theta: np.ndarray) -> None:
        """From here on derivatives near theta include those of the nonlinear compliance."""
        if self._pressures and self.forward.has_nonlinear_compliance:
            self.forward.use_full_jacobian(theta)

    def _whitening(self, d: _Observed, prediction: np.ndarray) -> Whitening:
        """Whitening by the covariance that a prediction (S, F) of an observation implies."""
        sigma = {"known": 0.0, "nominal": self.source_sd, "free": np.inf}[d.source]
        sd = np.sqrt(d.variance(self.model_error))
        return Whitening(d.noise.rotate(prediction), sd, np.full(len(d.power), sigma))

    def _slopes(self, theta: np.ndarray, prediction: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Derivatives of the predictions, list of (P, S, F)."""
        if self._pressures:
            slopes = self.forward.derivatives(theta)
            forward = self.forward
            return [slopes[:, rows, part] for rows, part in zip(forward.rows, forward.slices)]
        moved = [self.predict(theta + STEP * unit) for unit in np.eye(len(theta))]
        return [(np.stack(hs) - h) / STEP for hs, h in zip(zip(*moved), prediction)]

    def _best_source(self, d: _Observed, prediction, whitening: Whitening) -> np.ndarray:
        """Most likely source (F,) relative to that of the prediction."""
        if d.source == "known":
            return np.ones(len(d.power))
        h = d.noise.rotate(prediction)
        if d.source == "free":
            weight = 1.0 / d.variance(self.model_error)
            size = np.maximum(np.sum(weight * np.abs(h) ** 2, axis=0), 1e-300)
            return np.sum(weight * np.conj(h) * d.rotated, axis=0) / size
        pull = whitening.adjoint(whitening.apply(d.residual(prediction)))
        return 1.0 + self.source_sd**2 * np.sum(np.conj(h) * pull, axis=0)


class _Observed:
    """Values (S, F) of one observation, also in the eigenbasis of its noise."""

    def __init__(self, o, evenness: float):
        self.source, self.values = o.source, o.values
        self.noise = NoiseBasis(o.covariance)
        self.rotated = self.noise.rotate(o.values)
        power = np.mean(np.abs(o.values) ** 2, axis=0)  # (F,)
        self.power = (1.0 - evenness) * power + evenness * np.mean(power)

    def variance(self, model_error) -> np.ndarray:
        """Variance (..., S, F) of noise and model error (...)."""
        return self.noise.variances + model_error**2 * self.power

    def residual(self, prediction: np.ndarray) -> np.ndarray:
        """Residual (S, F) in the eigenbasis."""
        return self.rotated - self.noise.rotate(prediction)

    def cost(self, prediction, model_errors, sigmas, scale) -> np.ndarray:
        """Minus log likelihood (D, G) of model errors (D,) and source errors sigmas (G,).

        The squares are multiplied by `scale`.
        """
        variance = self.variance(model_errors[:, None, None])  # (D, S, F)
        h = self.noise.rotate(prediction)
        e = self.rotated - h
        square = np.sum(np.abs(e) ** 2 / variance, axis=1)
        cross = np.abs(np.sum(np.conj(h) * e / variance, axis=1)) ** 2
        size = np.maximum(np.sum(np.abs(h) ** 2 / variance, axis=1), 1e-300)
        logs = np.sum(np.log(variance), axis=(1, 2))
        if self.source == "free":
            logs = logs + np.sum(np.log(size), axis=1)
            cost = scale * np.sum(square - cross / size, axis=1) + logs
            return np.repeat(cost[:, None], len(sigmas), axis=1)
        if self.source == "known":
            sigmas = np.zeros_like(sigmas)
        stretch = 1.0 + sigmas[:, None] ** 2 * size[:, None, :]  # (D, G, F)
        along = np.sum(sigmas[:, None] ** 2 * cross[:, None, :] / stretch, axis=2)
        return (
            scale * (np.sum(square, axis=1)[:, None] - along)
            + logs[:, None]
            + np.sum(np.log(stretch), axis=2)
        )


def comparable(observation, rig):
    """The observation in the quantity that `ForwardModel` predicts.

    An input impedance becomes a reflection coefficient (see `reflection`), its
    covariance with it: dR = 2 dz/(z + 1)^2 with z over the data sheet's rho a/A. The rest stays.
    """
    if observation.kind != "input_impedance":
        return observation
    unit = 1.0 if observation.normalised else characteristic_impedance(rig.fluid, rig.line[0])
    z = observation.values / unit
    slope = np.abs(2.0 / (z[0] + 1.0) ** 2) ** 2 / unit**2
    return replace(
        observation,
        values=reflection(z),
        covariance=observation.covariance * slope[:, None, None],
    )
