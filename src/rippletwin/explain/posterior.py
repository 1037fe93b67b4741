"""How likely the data are under a twin, with derivatives: `rippletwin.likelihood` for explaining.

The model of the errors is that of `rippletwin.likelihood`: noise with a covariance C, a relative
model error delta common to all sensors, and a relative source error sigma along the prediction,

    E[e e^H] = C + delta^2 m I + sigma^2 h h^H,

built from the prediction h and not from the data (a shrinking model would fit anything else).
Explaining adds a least delta, and the choice to be blind to the source: sigma infinite, which
projects its amplitude and phase out at every frequency. All observations stand side by side.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rippletwin.explain.gradient import STEP, DifferentiableForward
from rippletwin.likelihood import comparable, cut

FLOOR = 0.004
"""Least relative model error. A twin of a real line is not better than this however small its
sensors' noise: harmonic means over a wandering speed, the orifice's exponent, the mesh."""

FLOORS = np.geomspace(FLOOR, 1.5, 16)
SOURCE_SDS = np.array([0.01, 0.02, 0.04, 0.07, 0.1])
"""Relative error of a nominal flow ripple's harmonic: one of these, the last being the largest
that is put down to the ripple."""


class Posterior:
    """Data below a frequency and the twin that is to predict them.

    twin, observations   all observations have the rig's sensors, or are one input impedance
    max_frequency_hz     nothing above it is used
    source_free          blind to the source

    `floor` and `source_sd` (delta and sigma) are set by `estimate_errors`.
    """

    def __init__(self, twin, observations: Sequence, max_frequency_hz=None, source_free=False):
        self.twin = twin
        self.observations = [cut(o, max_frequency_hz) for o in observations]
        self.forward = DifferentiableForward(twin, self.observations)
        self.source_free = source_free
        self.floor, self.source_sd, self.most = 0.1, float(SOURCE_SDS[2]), np.inf
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
        self.count = 2 * (self.values.size - int(np.sum(self._free)))
        self._pressures = all(o.kind != "input_impedance" for o in data)

    def predict(self, theta: np.ndarray) -> np.ndarray:
        """Predictions of all observations side by side, (S, F)."""
        return np.concatenate(self.forward(theta), axis=1)

    def residual(self, theta: np.ndarray, prediction: np.ndarray) -> np.ndarray:
        """Whitened residuals (2 S F,) of unit variance, then theta where it has a prior."""
        r = self.whitened(prediction)[0]
        return np.concatenate([_real(r).ravel(), theta[self.prior]])

    def objective(self, theta: np.ndarray, prediction: np.ndarray) -> float:
        """Minus the log posterior at the present errors, but for a constant."""
        r, log_determinant = self.whitened(prediction)
        prior = 0.5 * float(np.sum(theta[self.prior] ** 2))
        return prior + float(np.sum(np.abs(r) ** 2)) + log_determinant

    def whitened(self, prediction: np.ndarray) -> tuple[np.ndarray, float]:
        """Residuals (..., S, F) of unit variance and the log determinant of their covariance.

        A leading dimension of `prediction` is one of many predictions; the determinant is then
        the first one's.
        """
        sd = np.sqrt(self._variances + self.floor**2 * self.power)
        h = self._rotate(prediction)
        e, u = (self._rotated - h) / sd, h / sd
        size = np.maximum(np.sum(np.abs(u) ** 2, axis=-2), 1e-300)
        stretch = 1.0 + np.where(self._known, 0.0, self.source_sd**2) * size
        shorten = np.where(self._free, 1.0, 1.0 - 1.0 / np.sqrt(stretch))
        along = np.sum(np.conj(u) * e, axis=-2) / size
        r = e - (shorten * along)[..., None, :] * u
        first = (0,) * (prediction.ndim - 2)
        power = np.sum(np.abs(h[first]) ** 2, axis=0)
        volume = np.where(self._free, size[first] / power, stretch[first])
        return r, float(np.sum(np.log(sd**2)) + np.sum(np.log(volume)))

    def estimate_errors(self, prediction: np.ndarray) -> None:
        """Set floor and source error to their most likely values given the residuals.

        Degrees of freedom taken by the parameters are made up for by scaling the sum of squares.
        """
        taken = min(len(self.prior), 0.5 * self.count)
        scale = self.count / max(self.count - taken, 1.0)
        h = self._rotate(prediction)
        squares, inner = np.abs(self._rotated - h) ** 2, np.conj(h) * (self._rotated - h)
        sizes = np.abs(h) ** 2
        floors = FLOORS
        sds = SOURCE_SDS[:1] if np.all(self._free | self._known) else SOURCE_SDS
        for _ in range(2):
            weight = 1.0 / (self._variances + floors[:, None, None] ** 2 * self.power)
            square = np.sum(squares * weight, axis=1)  # (D, F)
            cross = np.abs(np.sum(inner * weight, axis=1)) ** 2
            size = np.maximum(np.sum(sizes * weight, axis=1), 1e-300)
            stretch = 1.0 + np.where(self._known, 0.0, sds[:, None, None] ** 2) * size  # (G, D, F)
            along = np.where(self._free, 1.0, 1.0 - 1.0 / stretch) * cross / size
            logs = np.log(np.where(self._free, size, stretch))
            cost = np.sum(scale * (square - along) + logs, axis=2)
            cost -= np.sum(np.log(weight), axis=(1, 2))
            source, best = np.unravel_index(np.argmin(cost), cost.shape)
            self.floor, self.source_sd = float(floors[best]), float(sds[source])
            near = floors[max(best - 1, 0)], floors[min(best + 1, len(floors) - 1)]
            floors, sds = np.geomspace(*near, 7), sds[source : source + 1]
        self.floor = min(self.floor, self.most)

    def linearise(self, theta: np.ndarray, prediction: np.ndarray):
        """Residual (N,) and its Jacobian (N, P) at the present errors."""
        if self._pressures:
            moved = prediction + STEP * self.forward.derivatives(theta)
        else:
            moved = np.stack([self.predict(theta + STEP * e) for e in np.eye(len(theta))])
        r = self.residual(theta, prediction)
        columns = _real(self.whitened(moved)[0]).reshape(len(theta), -1)
        count = columns.shape[1]
        jacobian = np.zeros((len(r), len(theta)))
        jacobian[:count] = (columns - r[:count]).T / STEP
        jacobian[count:] = np.eye(len(theta))[self.prior]
        return r, jacobian

    def best_source(self, prediction: np.ndarray) -> np.ndarray:
        """The prediction with every free source at its most likely amplitude, (S, F)."""
        weight = 1.0 / (self._variances + self.floor**2 * self.power)
        h = self._rotate(prediction)
        amplitude = np.sum(weight * np.conj(h) * self._rotated, 0) / np.sum(
            weight * np.abs(h) ** 2, 0
        )
        return np.where(self._free, amplitude, 1.0) * prediction

    def _rotate(self, x: np.ndarray) -> np.ndarray:
        return np.einsum("fsk,...sf->...kf", self._rotation, x)


def _real(r: np.ndarray) -> np.ndarray:
    """Complex residuals of unit variance as real ones: each part has half the variance."""
    return np.sqrt(2.0) * np.stack([r.real, r.imag], axis=-3)
