"""Where along the line: the gain of one free correction at each place.

Reciprocity makes the scan cheap. A shunt admittance y at x draws the flow y p(x), and a unit flow
drawn at x lowers what sensor s reads by Z_s(x), the transfer impedance:

    d p_s = -Z_s(x) y p(x)         (shunt)
    d p_s = -W_s(x) z q(x)         (series impedance z, W_s the response to a unit pressure step)

At every frequency and operating point y is free, with a prior as wide as the line's own
characteristic admittance; the line's parameters are refitted along (to first order, with their
priors). Both are Gaussian, so that the log evidence gained is exact for small corrections.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rippletwin.explain.fit import Fit
from rippletwin.explain.posterior import FLOOR, Posterior
from rippletwin.line.chain import Insert

STRENGTH = 0.3  # prior standard deviation of a correction, of the characteristic immittance
PLACES = 60
PROBE = 1e-3  # of the characteristic immittance


@dataclass(frozen=True)
class Profile:
    """Log evidence gained (PLACES,) at `position` (PLACES,) m by a free "shunt" or "series"."""

    position: np.ndarray
    gain: dict[str, np.ndarray]

    def interval(self, drop: float = 3.0) -> tuple[str, float, float]:
        """Kind and ends (m) of the stretch within `drop` of the best place."""
        kind = max(self.gain, key=lambda k: np.max(self.gain[k]))
        inside = self.position[self.gain[kind] > np.max(self.gain[kind]) - drop]
        return kind, float(inside[0]), float(inside[-1])


def profile(fit: Fit, observations: Sequence, places: int = PLACES) -> Profile | None:
    """The profile about a fit; None without two sensors."""
    if len(fit.twin.rig.sensors) < 2 or any(o.kind == "input_impedance" for o in observations):
        return None
    posterior = Posterior(fit.twin, observations, None, fit.source_free)
    posterior.floor, posterior.source_sd = FLOOR, fit.source_sd
    theta = fit.twin.theta
    prediction = posterior.predict(theta)
    r, jacobian = posterior.linearise(theta, prediction)
    residual = r[: 2 * prediction.size]
    jacobian = jacobian[: 2 * prediction.size]
    network = posterior.forward.network(theta)
    length = network.length
    position = (np.arange(places) + 0.5) / places * length
    gains = {}
    for kind in ("shunt", "series"):
        unit = np.sqrt(network.shunt[0] / network.series[0])
        unit = unit if kind == "shunt" else 1.0 / unit
        columns = [
            _columns(posterior, network, prediction, kind, x, PROBE * unit) for x in position
        ]
        gains[kind] = np.array([_gain(residual, jacobian, c) for c in columns])
    return Profile(position, gains)


def _columns(posterior, network, prediction, kind, x, immittance) -> np.ndarray:
    """Whitened responses (S, F, complex) to a correction of STRENGTH at x, frequency by frequency.

    A correction acts on its own frequency alone, so one column a frequency is all there is.
    """
    network.inserts.append(Insert(float(x), kind, immittance))
    held = network.load
    changed = network.readings()
    network.inserts.pop()
    network.load = held
    moved = posterior.whitened(np.stack([prediction, changed]))[0]
    return (moved[1] - moved[0]) / PROBE * STRENGTH


def _gain(residual: np.ndarray, jacobian: np.ndarray, columns: np.ndarray) -> float:
    """Log Bayes factor of free corrections, the line's parameters being refitted to first order.

    Each frequency's correction has one complex column c (S,): marginalised, it turns the unit
    covariance of that frequency into I + c c^H. The parameters are then refitted in the weight of
    its inverse.
    """
    shape = columns.shape
    z = _complex(residual, shape)
    jac = _complex(jacobian.T, (jacobian.shape[1], *shape))
    size = np.sum(np.abs(columns) ** 2, axis=0)
    shrink = 1.0 / (1.0 + size)

    def weigh(x):
        inner = np.sum(np.conj(columns) * x, axis=-2, keepdims=True)
        return x - (shrink * inner) * columns

    flat = jac.reshape(len(jac), -1)
    before = _refitted(z.ravel(), flat, z.ravel(), flat)
    after = _refitted(z.ravel(), flat, weigh(z).ravel(), weigh(jac).reshape(len(jac), -1))
    return before - after - float(np.sum(np.log1p(size)))


def _refitted(z, jac, weighted_z, weighted_jac) -> float:
    """Least sum of squares (plus half the log determinant) over the parameters with unit priors."""
    hessian = 2.0 * (np.conj(jac) @ weighted_jac.T).real + np.eye(len(jac))
    gradient = 2.0 * (np.conj(jac) @ weighted_z).real
    square = float(np.sum(np.conj(z) * weighted_z).real)
    reduced = square - 0.5 * float(gradient @ np.linalg.solve(hessian, gradient))
    return reduced + 0.5 * float(np.linalg.slogdet(hessian)[1])


def _complex(x: np.ndarray, shape: tuple) -> np.ndarray:
    """Real residuals of `Posterior` (..., 2 S F) as complex ones of unit variance, `shape`."""
    parts = x.reshape(*x.shape[:-1], 2, -1) / np.sqrt(2.0)
    return (parts[..., 0, :] + 1j * parts[..., 1, :]).reshape(shape)
