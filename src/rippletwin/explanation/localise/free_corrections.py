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
from dataclasses import dataclass, replace

import numpy as np

from rippletwin.calibration.fit import Fit, posterior_at_fit
from rippletwin.calibration.posterior import MIN_MODEL_ERROR
from rippletwin.explanation.localise.missing_immittance import whitened_columns
from rippletwin.line.frequency_domain.line_network import Insert

CORRECTION_SD = 0.3  # prior standard deviation of a correction, of the characteristic immittance
POSITIONS_SCANNED = 60
PROBE_SHARE = 1e-3  # of the correction


@dataclass(frozen=True)
class Profile:
    """Log evidence gained (PLACES,) at `position` (PLACES,) m by a free "shunt" or "series".

    `left` is the mean square that the best of them leaves of the whitened residual: above 1 no
    single place accounts for all, and differences of evidence weigh that much less.
    """

    position: np.ndarray
    gain: dict[str, np.ndarray]
    left: float = 1.0

    def interval(self, drop: float = 3.0) -> tuple[str, float, float]:
        """Kind and ends (m) of the stretch within `drop` of the best place."""
        kind = max(self.gain, key=lambda k: np.max(self.gain[k]))
        drop = drop * max(self.left, 1.0)
        inside = self.position[self.gain[kind] > np.max(self.gain[kind]) - drop]
        half = 0.5 * (self.position[1] - self.position[0])  # of the scan's step
        return kind, float(inside[0] - half), float(inside[-1] + half)


def _profile_positions(scan: _Scan) -> Profile:
    position = (np.arange(POSITIONS_SCANNED) + 0.5) / POSITIONS_SCANNED * scan.network.length
    found = {
        kind: np.array([scan.weigh(scan.at(kind, x)) for x in position])
        for kind in ("shunt", "series")
    }
    best = max(found.values(), key=lambda pairs: pairs[:, 0].max())
    left = float(best[np.argmax(best[:, 0]), 1])
    return Profile(position, {kind: pairs[:, 0] for kind, pairs in found.items()}, left)


def _gains_of_elements(scan: _Scan, rig) -> dict[str, float]:
    """Log evidence gained by one free correction a frequency of each element of the rig.

    "source", "load" (admittance beside it), "segment k, series" and "segment k, shunt" (the whole
    segment's impedance or admittance per metre) and "sensor NAME".
    """
    gains = {"source": scan.gain(scan.prediction * CORRECTION_SD)}
    for k in range(len(rig.line)):
        for kind in ("series", "shunt"):
            gains[f"segment {k + 1}, {kind}"] = scan.gain(scan.along(kind, k))
    gains["load"] = scan.gain(scan.at("shunt", scan.network.length))
    for k, sensor in enumerate(rig.sensors):
        row = np.zeros_like(scan.prediction)
        row[k] = CORRECTION_SD * scan.prediction[k]
        gains[f"sensor {sensor.name}"] = scan.gain(row)
    return gains


@dataclass(frozen=True)
class Located:
    """Where a mismatch sits before anything is named.

    element    "source", "load", "sensor NAME", "segment k" (all of it) or "position"
    position   interval (m from the pump)
    kind       "shunt", "series", or "" for source and sensors
    gains      of every element, and of the best "position"
    profile    of every position
    """

    element: str
    position: tuple[float, float]
    kind: str
    gains: dict[str, float]
    profile: Profile


def locate(fit: Fit, observations: Sequence) -> Located | None:
    """The element whose free correction adds most evidence to a fit; None without two sensors.

    One place is preferred to the whole segment about it unless that is clearly better.
    """
    rig = fit.twin.rig
    if len(rig.sensors) < 2 or any(o.kind == "input_impedance" for o in observations):
        return None
    scan = _Scan(fit, observations)
    gains, profile = _gains_of_elements(scan, rig), _profile_positions(scan)
    kind, low, high = profile.interval()
    drop = 3.0 * max(profile.left, 1.0)
    gains["position"] = float(np.max(profile.gain[kind]))
    best = max(gains, key=gains.get)
    if gains["position"] > gains[best] - drop:
        ends = max(low, 0.0), min(high, float(rig.length))
        return Located("position", ends, kind, gains, profile)
    element, _, kind = best.partition(", ")
    return Located(element, element_extent(rig, element), kind, gains, profile)


def element_extent(rig, element: str) -> tuple[float, float]:
    """Interval along the line (m) of an element of the rig; all of it where it has no place."""
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
    """A fit's whitened residual and Jacobian, against which corrections are held.

    A correction is the change (S, F) of the prediction that it makes at STRENGTH: it acts on its
    own frequency alone, so one column a frequency is all there is.
    """

    def __init__(self, fit: Fit, observations: Sequence):
        self.posterior = posterior_at_fit(fit, observations, MIN_MODEL_ERROR)
        theta = fit.twin.theta
        self.prediction = self.posterior.predict(theta)
        r, jacobian = self.posterior.linearise(theta, self.prediction)
        self.residual = r[: 2 * self.prediction.size]
        self.jacobian = jacobian[: 2 * self.prediction.size]
        self.network = self.posterior.forward.network(theta)

    def at(self, kind: str, x: float) -> np.ndarray:
        """Of a "shunt" or a "series" element at x (m)."""
        unit = np.sqrt(self.network.shunt[0] / self.network.series[0])
        unit = unit if kind == "shunt" else 1.0 / unit
        inserts = [*self.network.inserts, Insert(float(x), kind, PROBE_SHARE * unit)]
        return self._change(replace(self.network, inserts=inserts))

    def along(self, kind: str, segment: int) -> np.ndarray:
        """Of a segment's "series" impedance or "shunt" admittance per metre."""
        changed = getattr(self.network, kind).copy()
        changed[segment] *= 1.0 + PROBE_SHARE
        return self._change(replace(self.network, **{kind: changed}))

    def _change(self, network) -> np.ndarray:
        return (network.readings() - self.network.readings()) / PROBE_SHARE * CORRECTION_SD

    def gain(self, change: np.ndarray) -> float:
        """Log evidence that a free multiple of `change` at each frequency adds."""
        return self.weigh(change)[0]

    def weigh(self, change: np.ndarray) -> tuple[float, float]:
        """`gain`, and the mean square left of the whitened residual."""
        columns = whitened_columns(
            self.posterior, self.prediction, self.prediction + PROBE_SHARE * change
        )
        return _log_bayes_factor(self.residual, self.jacobian, columns / PROBE_SHARE)


def _log_bayes_factor(
    residual: np.ndarray, jacobian: np.ndarray, columns: np.ndarray
) -> tuple[float, float]:
    """Log Bayes factor of free corrections and the mean square left, the line's parameters being
    refitted to first order.

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
    before = _refit_linearised(z.ravel(), flat, z.ravel(), flat)
    after = _refit_linearised(z.ravel(), flat, weigh(z).ravel(), weigh(jac).reshape(len(jac), -1))
    left = after[0] / max(z.size - size.size, 1)
    return sum(before) - sum(after) - float(np.sum(np.log1p(size))), left


def _refit_linearised(z, jac, weighted_z, weighted_jac) -> tuple[float, float]:
    """Least sum of squares over the parameters with unit priors, and half the log determinant."""
    hessian = 2.0 * (np.conj(jac) @ weighted_jac.T).real + np.eye(len(jac))
    gradient = 2.0 * (np.conj(jac) @ weighted_z).real
    square = float(np.sum(np.conj(z) * weighted_z).real)
    reduced = square - 0.5 * float(gradient @ np.linalg.solve(hessian, gradient))
    return reduced, 0.5 * float(np.linalg.slogdet(hessian)[1])


def _complex(x: np.ndarray, shape: tuple) -> np.ndarray:
    """Real residuals of `Posterior` (..., 2 S F) as complex ones of unit variance, `shape`."""
    parts = x.reshape(*x.shape[:-1], 2, -1) / np.sqrt(2.0)
    return (parts[..., 0, :] + 1j * parts[..., 1, :]).reshape(shape)
