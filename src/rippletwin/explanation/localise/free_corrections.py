"""Where along the line is the mismatch? The evidence for one free correction at each place.

Reciprocity makes the scan cheap. A shunt admittance y at x draws the flow y p(x), and a unit flow
drawn at x lowers the reading of sensor s by Z_s(x), the transfer impedance:

    d p_s = -Z_s(x) y p(x)         (shunt)
    d p_s = -W_s(x) z q(x)         (series impedance z, W_s the response to a unit pressure step)

At every frequency and operating point y is free. Its prior is as wide as the line's characteristic
admittance. The parameters of the line are refitted to first order, with their priors. Both are
Gaussian, so the log Bayes factor is exact for small corrections.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rippletwin.calibration.fit import Fit, posterior_at_fit
from rippletwin.explanation.localise.missing_immittance import whiten_columns
from rippletwin.explanation.thresholds import EQUIVALENT_LOG_BAYES_FACTOR, LITTLE_MODEL_ERROR
from rippletwin.line.frequency_domain.line_network import Insert

CORRECTION_SD = 0.3  # prior standard deviation, relative to the characteristic immittance
POSITIONS_SCANNED = 60
PROBE_SHARE = 1e-3  # of the correction, for finite differences


@dataclass(frozen=True)
class PositionProfile:
    """Log Bayes factor of a free "shunt" or "series" element along the line.

    position           (POSITIONS_SCANNED,) m from the pump
    log_bayes_factors  (POSITIONS_SCANNED,) of each kind of element
    residual_left      mean square of the whitened residual with the best element. Above 1 no single
                       place accounts for the whole residual, and differences of evidence count
                       for less by this factor.
    """

    position: np.ndarray
    log_bayes_factors: dict[str, np.ndarray]
    residual_left: float = 1.0

    @property
    def margin(self) -> float:
        """Log Bayes factor between equivalent positions."""
        return EQUIVALENT_LOG_BAYES_FACTOR * max(self.residual_left, 1.0)

    def best_interval(self) -> tuple[str, float, float]:
        """Kind of the best element, and the ends (m) of the stretch within `margin` of it."""
        kind = max(self.log_bayes_factors, key=lambda k: np.max(self.log_bayes_factors[k]))
        values = self.log_bayes_factors[kind]
        inside = self.position[values > np.max(values) - self.margin]
        half_step = 0.5 * (self.position[1] - self.position[0])
        return kind, float(inside[0] - half_step), float(inside[-1] + half_step)


def _scan_positions(scan: _Scan) -> PositionProfile:
    position = (np.arange(POSITIONS_SCANNED) + 0.5) / POSITIONS_SCANNED * scan.network.length
    pairs = {
        kind: np.array([scan.compare(scan.change_at(kind, x)) for x in position])
        for kind in ("shunt", "series")
    }
    best = max(pairs.values(), key=lambda columns: columns[:, 0].max())
    residual_left = float(best[np.argmax(best[:, 0]), 1])
    log_bayes_factors = {kind: columns[:, 0] for kind, columns in pairs.items()}
    return PositionProfile(position, log_bayes_factors, residual_left)


def _scan_elements(scan: _Scan, rig) -> dict[str, float]:
    """Log Bayes factor of one free correction per frequency of each element of the rig.

    "source", "load" (an admittance beside it), "segment k, series" and "segment k, shunt" (the
    impedance or admittance per metre of the whole segment) and "sensor NAME".
    """
    changes = {"source": scan.prediction * CORRECTION_SD}
    for k in range(len(rig.line)):
        for kind in ("series", "shunt"):
            changes[f"segment {k + 1}, {kind}"] = scan.change_along(kind, k)
    changes["load"] = scan.change_at("shunt", scan.network.length)
    for k, sensor in enumerate(rig.sensors):
        row = np.zeros_like(scan.prediction)
        row[k] = CORRECTION_SD * scan.prediction[k]
        changes[f"sensor {sensor.name}"] = row
    return {name: scan.compare(change)[0] for name, change in changes.items()}


@dataclass(frozen=True)
class MismatchLocation:
    """Where the mismatch is, before any effect is named.

    element            "source", "load", "sensor NAME", "segment k" (all of it) or "position"
    position           interval (m from the pump)
    kind               "shunt", "series", or "" for source and sensors
    log_bayes_factors  of every element, and of the best "position"
    profile            of all positions
    """

    element: str
    position: tuple[float, float]
    kind: str
    log_bayes_factors: dict[str, float]
    profile: PositionProfile


def locate_mismatch(fit: Fit, observations: Sequence) -> MismatchLocation | None:
    """The element whose free correction adds most evidence to a fit; None without two sensors.

    A position is preferred to the whole segment around it unless that is clearly better.
    """
    rig = fit.twin.rig
    if len(rig.sensors) < 2 or any(o.kind == "input_impedance" for o in observations):
        return None
    scan = _Scan(fit, observations)
    log_bayes_factors, profile = _scan_elements(scan, rig), _scan_positions(scan)
    kind, low, high = profile.best_interval()
    log_bayes_factors["position"] = float(np.max(profile.log_bayes_factors[kind]))
    best = max(log_bayes_factors, key=log_bayes_factors.get)
    if log_bayes_factors["position"] > log_bayes_factors[best] - profile.margin:
        ends = max(low, 0.0), min(high, float(rig.length))
        return MismatchLocation("position", ends, kind, log_bayes_factors, profile)
    element, kind = best, ""
    if best.startswith("segment"):
        element, _, kind = best.partition(", ")
    extent = element_extent(rig, element)
    return MismatchLocation(element, extent, kind, log_bayes_factors, profile)


def element_extent(rig, element: str) -> tuple[float, float]:
    """Interval along the line (m) of an element of the rig; the whole line for one without."""
    if element.startswith("segment"):
        ends = np.cumsum([0.0, *(s.length for s in rig.line)])
        k = int(element.split()[1])
        return float(ends[k - 1]), float(ends[k])
    if element.startswith("sensor"):
        (x,) = [s.position for s in rig.sensors if f"sensor {s.name}" == element]
        return float(x), float(x)
    total = float(rig.length)
    return {"source": (0.0, 0.0), "load": (total, total)}.get(element, (0.0, total))


class _Scan:
    """Whitened residual and Jacobian of a fit, with which corrections are compared.

    A correction is given by the change (S, F) of the prediction that CORRECTION_SD of it makes. It
    acts on its own frequency alone, so one column per frequency describes it.
    """

    def __init__(self, fit: Fit, observations: Sequence):
        self.posterior = posterior_at_fit(fit, observations, LITTLE_MODEL_ERROR)
        theta = fit.twin.theta
        self.prediction = self.posterior.predict(theta)
        r, jacobian = self.posterior.linearise(theta, self.prediction)
        self.residual = r[: 2 * self.prediction.size]
        self.jacobian = jacobian[: 2 * self.prediction.size]
        self.network = self.posterior.forward.network(theta)

    def change_at(self, kind: str, x: float) -> np.ndarray:
        """Change (S, F) by a "shunt" or "series" element at x (m)."""
        unit = np.sqrt(self.network.shunt[0] / self.network.series[0])
        unit = unit if kind == "shunt" else 1.0 / unit
        inserts = [*self.network.inserts, Insert(float(x), kind, PROBE_SHARE * unit)]
        return self._change_to(replace(self.network, inserts=inserts))

    def change_along(self, kind: str, segment: int) -> np.ndarray:
        """Change (S, F) by a segment's "series" impedance or "shunt" admittance per metre."""
        per_metre = getattr(self.network, kind).copy()
        per_metre[segment] *= 1.0 + PROBE_SHARE
        return self._change_to(replace(self.network, **{kind: per_metre}))

    def _change_to(self, network) -> np.ndarray:
        return (network.readings() - self.network.readings()) / PROBE_SHARE * CORRECTION_SD

    def compare(self, change: np.ndarray) -> tuple[float, float]:
        """Log Bayes factor of a free multiple of `change` per frequency, and the mean square of
        the whitened residual that it leaves."""
        columns = whiten_columns(
            self.posterior, self.prediction, self.prediction + PROBE_SHARE * change
        )
        return _log_bayes_factor(self.residual, self.jacobian, columns / PROBE_SHARE)


def _log_bayes_factor(
    residual: np.ndarray, jacobian: np.ndarray, columns: np.ndarray
) -> tuple[float, float]:
    """Log Bayes factor of free corrections, and the mean square of the residual that is left.

    The correction of each frequency has one complex column c (S,). Marginalised, it turns the unit
    covariance of that frequency into I + c c^H. The parameters of the line are refitted to first
    order with its inverse as weight.
    """
    shape = columns.shape
    z = _complex(residual, shape)
    jac = _complex(jacobian.T, (jacobian.shape[1], *shape))
    power = np.sum(np.abs(columns) ** 2, axis=0)
    shrink = 1.0 / (1.0 + power)

    def weigh(x):
        inner = np.sum(np.conj(columns) * x, axis=-2, keepdims=True)
        return x - (shrink * inner) * columns

    flat = jac.reshape(len(jac), -1)
    before = _refit_linearised(z.ravel(), flat, z.ravel(), flat)
    after = _refit_linearised(z.ravel(), flat, weigh(z).ravel(), weigh(jac).reshape(len(jac), -1))
    residual_left = after[0] / max(z.size - power.size, 1)
    log_bayes_factor = sum(before) - sum(after) - float(np.sum(np.log1p(power)))
    return log_bayes_factor, residual_left


def _refit_linearised(z, jac, weighted_z, weighted_jac) -> tuple[float, float]:
    """Least sum of squares over the parameters with unit priors, and half the log determinant."""
    hessian = 2.0 * (np.conj(jac) @ weighted_jac.T).real + np.eye(len(jac))
    gradient = 2.0 * (np.conj(jac) @ weighted_z).real
    square = float(np.sum(np.conj(z) * weighted_z).real)
    reduced = square - 0.5 * float(gradient @ np.linalg.solve(hessian, gradient))
    return reduced, 0.5 * float(np.linalg.slogdet(hessian)[1])


def _complex(x: np.ndarray, shape: tuple) -> np.ndarray:
    """Real residuals (..., 2 S F) of `Posterior` as complex ones of unit variance and `shape`."""
    parts = x.reshape(*x.shape[:-1], 2, -1) / np.sqrt(2.0)
    return (parts[..., 0, :] + 1j * parts[..., 1, :]).reshape(shape)
