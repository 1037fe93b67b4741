"""Free corrections that are smooth in frequency, of one element of the line at a time.

A correction is a complex Gaussian process g with

    <g(f) g(f')*> = a^2 exp(-(f - f')^2 / (2 l^2)).

It multiplies the reading of a sensor, the pump's flow, or the impedance or admittance per metre of
a segment, or it is a shunt or series element at a position. Fit, correction and residual enter to
first order about a mode theta, so every amplitude is integrated out in closed form:

    r - J theta ~ N(0, I + J J^T + a^2 G G^T),

r whitened residual, J its Jacobian, G the changes that a unit of the correction makes. The
amplitude a and the relative model error are unknown: the likelihood is averaged over grids of both.
(Kennedy and O'Hagan 2001, J. R. Stat. Soc. B 63:425; Rasmussen and Williams 2006, Gaussian
Processes for Machine Learning, eq. 2.30.)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.special import logsumexp

from rippletwin.calibration.fit import Fit
from rippletwin.calibration.posterior import Posterior
from rippletwin.explanation.localise.missing_immittance import observable_of
from rippletwin.line.frequency_domain.line_network import Insert

PROBE_SHARE = 1e-3  # of a correction, for finite differences
AMPLITUDES = np.geomspace(3e-3, 1.0, 6)
"""Values of a, relative to the element, or to the characteristic immittance at a position."""
CORRELATION_HZ = 400.0  # l
MODEL_ERRORS = np.geomspace(1e-3, 1.5, 13)
ERRORS_BELOW, ERRORS_ABOVE = 5, 1  # grid values of the model error around that of the fit
MIN_EIGENVALUE = 1e-3  # share of the kernel's largest; smaller ones are left out
MAX_POSITIONS = 12  # along the line, each a shunt and a series element
FLAT_SD = 1e3  # of a coordinate without a prior

NONE = "nothing"


class SmoothCorrections:
    """Log evidence of a fit's model with each possible correction.

    `theta` (P,) is where the model is linearised: the fit's mode by default.
    """

    def __init__(self, fit: Fit, observations: Sequence, theta: np.ndarray | None = None):
        self.fit, self.theta = fit, fit.twin.theta if theta is None else theta
        self._posterior = Posterior(fit.twin, observations, None, fit.source_free)
        self._prediction = self._posterior.predict(self.theta)
        self._posterior.estimate_errors(self._prediction, self.theta)
        self.network = self._posterior.forward.network(self.theta)
        self._observed = observable_of(self._posterior, self.network)
        self._basis = smooth_basis(self._posterior.forward.frequency_hz)
        slopes = self._posterior.slopes(self.theta, self._prediction)
        at = int(np.searchsorted(MODEL_ERRORS, self._posterior.model_error))
        self._errors = MODEL_ERRORS[max(at - ERRORS_BELOW, 0) : at + ERRORS_ABOVE + 1]
        self._expanded = [self._expand(error, slopes) for error in self._errors]

    def _expand(self, model_error: float, slopes: np.ndarray) -> tuple:
        """Residual at theta = 0, scaled Jacobian (P, N) and log determinant at a model error."""
        prior = self._posterior.prior
        self._posterior.model_error = float(model_error)
        r, jacobian = self._posterior.whiten_slopes(self._prediction, slopes)
        start = np.where(prior, self.theta, 0.0)
        scale = np.where(prior, 1.0, FLAT_SD)[:, None]
        return r - start @ jacobian, jacobian * scale, self._posterior.log_determinant()

    def log_evidence(self, change: np.ndarray | None = None) -> float:
        """Log evidence if the prediction may change by a smooth multiple of `change` (S, F).

        A constant that is common to all models of these data is left out.
        """
        values = []
        for error, (r, jacobian, log_determinant) in zip(self._errors, self._expanded):
            columns = jacobian
            amplitudes = np.zeros(1)
            if change is not None:
                self._posterior.model_error = float(error)
                free = np.concatenate([self._basis, 1j * self._basis])[:, None] * change
                free = self._posterior.whiten_slopes(self._prediction, free)[1]
                columns, amplitudes = np.concatenate([jacobian, free]), AMPLITUDES
            gram, along = columns @ columns.T, columns @ r
            scales = np.ones((len(amplitudes), len(columns)))
            scales[:, len(jacobian) :] = amplitudes[:, None]
            each = [_log_likelihood(r, gram, along, scale) for scale in scales]
            values.append(logsumexp(each) - np.log(len(each)) - log_determinant)
        return float(logsumexp(values) - np.log(len(MODEL_ERRORS)))

    def most_likely(self, element: tuple) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Frequencies (F,), the most likely correction (F,) of an element, and how well each
        frequency determines it: the power (F,) of what a unit of it changes, whitened."""
        change, best = self.change(element), (-np.inf, None)
        free = np.concatenate([self._basis, 1j * self._basis])[:, None] * change
        for error, (r, jacobian, log_determinant) in zip(self._errors, self._expanded):
            self._posterior.model_error = float(error)
            whitened = self._posterior.whiten_slopes(self._prediction, free)[1]
            columns = np.concatenate([jacobian, whitened])
            gram, along = columns @ columns.T, columns @ r
            for a in AMPLITUDES:
                scale = np.concatenate([np.ones(len(jacobian)), np.full(len(free), a)])
                value = _log_likelihood(r, gram, along, scale) - log_determinant
                if value > best[0]:
                    precision = scale[:, None] * gram * scale + np.eye(len(scale))
                    # The columns are derivatives of the residual: measured less predicted.
                    found = -scale * np.linalg.solve(precision, scale * along)
                    best = value, found[len(jacobian) :], error
        _, found, error = best
        self._posterior.model_error = float(error)
        count = len(self._basis)
        correction = (found[:count] + 1j * found[count:]) @ self._basis
        weight = np.sum(np.abs(change) ** 2, axis=0) / self._posterior.power / error**2
        return self._posterior.forward.frequency_hz, correction, weight

    def unit(self, element: tuple) -> np.ndarray:
        """The immittance (F,) of which a correction is a multiple, of an element of the line."""
        kind, where = element
        if kind.startswith("segment"):
            per_metre = getattr(self.network, kind.split()[1])
            return per_metre[where if isinstance(where, int) else where[0]]
        characteristic = np.sqrt(self.network.shunt[0] / self.network.series[0])
        return characteristic if kind == "shunt" else 1.0 / characteristic

    def by_element(self, elements: Sequence[tuple]) -> dict[tuple, float]:
        """Log evidence with the correction of each of `elements`, keys as in `elements_of`."""
        return {e: self.log_evidence(self.change(e)) for e in elements}

    def change(self, element: tuple) -> np.ndarray | None:
        """Change (S, F) of the prediction that a unit correction of an element makes."""
        kind, where = element
        network, line = self.network, {}
        if kind == NONE:
            return None
        if kind == "source":
            return self._prediction
        if kind == "sensor":
            row = np.zeros_like(self._prediction)
            row[where] = self._prediction[where]
            return row
        if kind in ("segment series", "segment shunt"):
            name = kind.split()[1]
            per_metre = getattr(network, name).copy()
            rows = [where] if isinstance(where, int) else list(where)
            per_metre[rows] = per_metre[rows] * (1.0 + PROBE_SHARE)
            line[name] = per_metre
        else:
            at = float(np.clip(where, 0.0, network.length))
            probe = Insert(at, kind, PROBE_SHARE * self.unit(element))
            line["inserts"] = [*network.inserts, probe]
        moved = observable_of(self._posterior, replace(network, **line))
        return (moved - self._observed) / PROBE_SHARE


def elements_of(rig, observations: Sequence, own: Sequence[tuple] = ()) -> list[tuple]:
    """The elements whose correction is tried: pairs (kind, where).

    (NONE, None); ("source", None); ("sensor", index); ("segment series" or "segment shunt", index
    or indices); ("shunt" or "series", position in m). `own` are further ones.
    """
    positions = (np.arange(MAX_POSITIONS) + 0.5) / MAX_POSITIONS * rig.length
    elements = [(NONE, None)]
    if not all(o.kind == "input_impedance" for o in observations):
        elements += [("source", None), *(("sensor", k) for k in range(len(rig.sensors)))]
    elements += [
        (f"segment {kind}", k) for k in range(len(rig.line)) for kind in ("series", "shunt")
    ]
    elements += [
        (kind, float(x)) for x in (0.0, *positions, rig.length) for kind in ("shunt", "series")
    ]
    return [*elements, *(e for e in own if e not in elements)]


def own_element(effect, place, values: Mapping[str, float], rig) -> tuple:
    """The element at which an effect itself acts, with its fitted `values`."""
    everywhere = tuple(range(len(rig.line))) if len(rig.line) > 1 else 0
    if effect.element == "sensor":
        return "sensor", place.index
    if effect.element == "segment":
        return "segment shunt", place.index
    if effect.element == "line":
        return ("segment series" if effect.friction else "segment shunt"), everywhere
    position = {"source": 0.0, "load": float(rig.length)}.get(effect.element)
    if position is None:
        position = float(values["position"])
    return (place.form if place.form in ("shunt", "series") else "shunt"), position


def smooth_basis(frequency_hz: np.ndarray) -> np.ndarray:
    """Basis (K, F) of functions smooth in frequency with basis.T @ basis = kernel of unit size."""
    f = np.asarray(frequency_hz, float) / CORRELATION_HZ
    values, vectors = np.linalg.eigh(np.exp(-0.5 * np.subtract.outer(f, f) ** 2))
    kept = values > MIN_EIGENVALUE * np.max(values)
    return np.sqrt(0.5 * values[kept])[:, None] * vectors[:, kept].T


def _log_likelihood(r: np.ndarray, gram: np.ndarray, along: np.ndarray, scale: np.ndarray) -> float:
    """-1/2 r^T C^-1 r - 1/2 log det C with C = I + A^T diag(scale^2) A.

    gram = A A^T, along = A r.
    """
    precision = scale[:, None] * gram * scale
    precision[np.diag_indices_from(precision)] += 1.0
    factor = cholesky(precision, lower=True, check_finite=False)
    shift = solve_triangular(factor, scale * along, lower=True, check_finite=False)
    square = float(r @ r - shift @ shift)
    return -0.5 * square - float(np.sum(np.log(np.diag(factor))))
