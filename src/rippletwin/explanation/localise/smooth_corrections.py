"""Free corrections that are smooth in frequency, of one element of the line at a time.

A correction is a complex Gaussian process g with

    <g(f) g(f')*> = a^2 exp(-(f - f')^2 / (2 l^2)).

It multiplies the reading of a sensor, the pump's flow, or the impedance or admittance per metre of
a segment, or it is a shunt or series element at a position (`elements`). Fit, correction and
residual enter to first order about a mode theta, so every amplitude is integrated out in closed
form:

    r - J theta ~ N(0, I + J J^T + a^2 G G^T),

r whitened residual, J its Jacobian, G the changes that a unit of the correction makes. The
amplitude a and the relative model error are unknown: the likelihood is averaged over grids of both.
What linearising gains or loses at the most likely amplitudes is put right: there the square sum is
calculated without it, but for what a nonlinear compliance takes up, which stays as at the mode.
(Kennedy and O'Hagan 2001, J. R. Stat. Soc. B 63:425; Rasmussen and Williams 2006, Gaussian
Processes for Machine Learning, eq. 2.30.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import logsumexp

from rippletwin.calibration.fit import Fit
from rippletwin.calibration.posterior import Posterior
from rippletwin.explanation.localise.elements import NONE, correct_line, position_spacing
from rippletwin.explanation.localise.linear_model import Correction, LinearModel
from rippletwin.explanation.localise.missing_immittance import observable_of

PROBE_SHARE = 1e-3  # of a correction, for finite differences
AMPLITUDES = np.geomspace(3e-3, 1.0, 6)
"""Values of a, relative to the element, or to the characteristic immittance at a position."""
CORRELATION_HZ = 400.0  # l
MODEL_ERRORS = np.geomspace(1e-3, 1.5, 13)
ERRORS_BELOW, ERRORS_ABOVE = 5, 1  # grid values of the model error around that of the fit
MIN_EIGENVALUE = 1e-3  # share of the kernel's largest; smaller ones are left out
POSITIONS_SOLVED = 3  # of each kind of element, those that promise most
STEP_SHARES = (1.0, 0.5, 0.25)
"""Of the way to the most likely correction, besides none of it. A linear step may overshoot: near a
sharp resonance a small correction changes the prediction by much."""
NEGLIGIBLE = 3.0  # log likelihood below the best at which an amplitude no longer counts
KEPT_PROMISE = 0.5  # log likelihood: a step that falls short by less is not shortened
FLAT_SD = 1e3  # of a coordinate without a prior


class SmoothCorrections:
    """Log evidence of a fit's model with each possible correction.

    `theta` (P,) is where the model is linearised: the fit's mode by default.
    """

    def __init__(self, fit: Fit, observations: Sequence, theta: np.ndarray | None = None):
        self.fit, self.theta = fit, fit.twin.theta if theta is None else theta
        self._posterior = Posterior(fit.twin, observations, None, fit.source_free)
        self._prediction = self._posterior.predict(self.theta)
        self._posterior.estimate_errors(self._prediction, self.theta)
        # As in the Jacobian: to solve it for each correction takes long, most of all in vain.
        forward = self._posterior.forward
        forward.freeze_compliance = forward.has_nonlinear_compliance
        self.network = forward.network(self.theta)
        self._observed = observable_of(self._posterior, self.network, self.theta)
        self._basis = smooth_basis(self.frequency_hz)
        slopes = self._posterior.slopes(self.theta, self._prediction)
        at = int(np.searchsorted(MODEL_ERRORS, self._posterior.model_error))
        self._errors = MODEL_ERRORS[max(at - ERRORS_BELOW, 0) : at + ERRORS_ABOVE + 1]
        expanded = (self._expand(e, slopes) for e in self._errors)
        self._models, self._log_determinants, self._at_mode = zip(*expanded)

    def _expand(self, model_error: float, slopes: np.ndarray) -> tuple[LinearModel, float, float]:
        """The linear model about theta = 0 and the log determinant at a model error; and half the
        square sum at the mode."""
        prior = self._posterior.prior
        self._posterior.model_error = float(model_error)
        r, jacobian = self._posterior.whiten_slopes(self._prediction, slopes)
        start = np.where(prior, self.theta, 0.0)
        scale = np.where(prior, 1.0, FLAT_SD)[:, None]
        linear = LinearModel(r - start @ jacobian, jacobian * scale)
        log_determinant = self._posterior.whitened(self._prediction)[1]
        return linear, log_determinant, 0.5 * float(r @ r + start @ start)

    def log_evidence(self, element: tuple = (NONE, None)) -> float:
        """Log evidence if an element, as in `elements`, may have a smooth correction.

        A constant that is common to all models of these data is left out.
        """
        return self._solve(element).log_evidence

    def most_likely(self, element: tuple) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Frequencies (F,), Hz, the most likely relative correction (F,) of an element, and how
        well each frequency determines it: the power (F,) of what a unit of it changes, whitened."""
        solved = self._solve(element)
        power = self._posterior.power * solved.model_error**2
        weight = np.sum(np.abs(solved.change) ** 2, axis=0) / power
        return self.frequency_hz, solved.correction, weight

    def _solve(self, element: tuple) -> _Solved:
        """Average over model errors and amplitudes of a correction, and the most likely of them."""
        change = self.change(element)
        amplitudes = np.zeros(1) if change is None else AMPLITUDES
        free = None if change is None else self._free_changes(change)
        corrected = [self._correct(k, free) for k in range(len(self._errors))]
        values = np.array([each.log_likelihoods(amplitudes) for each in corrected])
        values -= np.array(self._log_determinants)[:, None]
        solved: list[tuple] = []
        for m in np.argsort(-np.max(values, axis=0)):
            k = int(np.argmax(values[:, m]))
            if solved and values[k, m] < max(each[0] for each in solved) - NEGLIGIBLE:
                continue
            gain, correction = self._delinearise(element, k, amplitudes[m], corrected[k])
            values[:, m] += gain
            solved.append((values[k, m], float(self._errors[k]), correction))
        evidence = logsumexp(values) - np.log(len(amplitudes) * len(MODEL_ERRORS))
        _, model_error, correction = max(solved, key=lambda each: each[0])
        return _Solved(float(evidence), model_error, correction, change)

    def _delinearise(
        self, element: tuple, error: int, amplitude: float, corrected: Correction
    ) -> tuple[float, np.ndarray]:
        """Log likelihood at the most likely parameters and correction without linearising less
        that with it, and the correction (F,); `error` is the index of a model error."""
        unit, amplitudes, linear = corrected.most_likely(amplitude)
        theta = np.where(self._posterior.prior, unit, self.theta + FLAT_SD * unit)
        half = len(amplitudes) // 2
        correction = (amplitudes[:half] + 1j * amplitudes[half:]) @ self._basis[:half]
        size = float(np.sum((amplitudes / amplitude) ** 2)) if amplitude else 0.0
        self._posterior.model_error = float(self._errors[error])
        on_the_way = self._least_objective(element, theta, correction, unit, size, linear)
        return linear - min(self._at_mode[error], on_the_way), correction

    def _least_objective(
        self,
        element: tuple,
        theta: np.ndarray,
        correction: np.ndarray,
        unit: np.ndarray,
        size: float,
        promised: float,
    ) -> float:
        """Least half square sum on the way to a most likely theta (P,) and `correction` (F,) of an
        element, without linearising.

        unit       (P,) parameters there, in standard deviations
        size       square of the correction there, in its own
        promised   the half square sum there, linearised: where it is kept, no other step has less
        """
        posterior = self._posterior
        start = np.where(posterior.prior, self.theta, 0.0)
        least = np.inf
        for share in STEP_SHARES:
            here = self.theta + share * (theta - self.theta)
            network = posterior.forward.network(here)
            prediction = self._observe(network, element, share * correction, here)
            if not posterior.is_valid(prediction):
                continue
            square = np.sum(np.abs(posterior.whitened(prediction)[0]) ** 2)
            square += 0.5 * np.sum((start + share * (unit - start)) ** 2)
            square += 0.5 * share**2 * size
            least = min(least, float(square))
            if least < promised + KEPT_PROMISE:
                break
        return least

    @cached_property
    def promises(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Positions (N,), m, along the whole line and the promise (N,) of a correction there, of
        each kind of element at a position."""
        rig = self.fit.twin.rig
        count = max(int(np.ceil(rig.length / position_spacing(rig, self.frequency_hz))), 1)
        positions = (np.arange(count) + 0.5) / count * self.network.length
        return {
            kind: (positions, np.array([self._promise((kind, float(x))) for x in positions]))
            for kind in ("shunt", "series")
        }

    def promising_positions(self) -> list[tuple]:
        """The elements at the positions that promise most, of each kind the best local maxima."""
        chosen = []
        for kind, (positions, promises) in self.promises.items():
            padded = np.concatenate([[-np.inf], promises, [-np.inf]])
            highest = (promises >= padded[:-2]) & (promises >= padded[2:])
            best = sorted(np.flatnonzero(highest), key=lambda k: -promises[k])[:POSITIONS_SOLVED]
            chosen += [(kind, float(positions[k])) for k in best]
        return chosen

    @property
    def frequency_hz(self) -> np.ndarray:
        """Frequencies (F,), Hz, of all observations side by side."""
        return self._posterior.forward.frequency_hz

    def _promise(self, element: tuple) -> float:
        """Log likelihood with the correction of an element at the fit's own model error and the
        most likely amplitude, to first order."""
        at = int(np.argmin(np.abs(np.log(self._errors / self.fit.model_error))))
        corrected = self._correct(at, self._free_changes(self.change(element)))
        return float(np.max(corrected.log_likelihoods(AMPLITUDES)) - self._log_determinants[at])

    def _free_changes(self, change: np.ndarray) -> np.ndarray:
        """Changes (2 K, S, F) that the amplitudes of a correction make, given that of a unit."""
        return np.concatenate([self._basis, 1j * self._basis])[:, None] * change

    def _correct(self, error: int, free: np.ndarray | None) -> Correction:
        """The linear model at a model error (its index) with changes `free`, or without any."""
        model = self._models[error]
        if free is None:
            return model.with_correction(np.empty((0, len(model.residual))))
        self._posterior.model_error = float(self._errors[error])
        return model.with_correction(self._posterior.whiten_slopes(self._prediction, free)[1])

    def by_element(self, elements: Sequence[tuple]) -> dict[tuple, float]:
        """Log evidence with the correction of each of `elements`; these are the keys."""
        return {e: self.log_evidence(e) for e in elements}

    def change(self, element: tuple) -> np.ndarray | None:
        """Change (S, F) of the prediction, in its unit, that a unit correction of an element makes;
        None without an element."""
        if element[0] == NONE:
            return None
        moved = self._observe(self.network, element, PROBE_SHARE, self.theta)
        return (moved - self._observed) / PROBE_SHARE

    def _observe(self, network, element: tuple, correction, theta: np.ndarray) -> np.ndarray:
        """What is observed (S, F) of a network at theta with a `correction`, (F,) or a number, of
        an element."""
        kind, where = element
        corrected = correct_line(network, element, correction, self.network)
        observed = observable_of(self._posterior, corrected, theta)
        if kind == "source":
            return observed * (1.0 + correction)
        if kind == "sensor":
            observed[where] = observed[where] * (1.0 + correction)
        return observed


@dataclass(frozen=True)
class _Solved:
    """Log evidence with a correction, the most likely one (F,) with its model error, and the change
    (S, F) that a unit of it makes, None where there is none."""

    log_evidence: float
    model_error: float
    correction: np.ndarray
    change: np.ndarray | None


def smooth_basis(frequency_hz: np.ndarray) -> np.ndarray:
    """Basis (K, F) of functions smooth over frequency_hz (F,), with 2 basis.T @ basis = the kernel
    of unit size."""
    f = np.asarray(frequency_hz, float) / CORRELATION_HZ
    values, vectors = np.linalg.eigh(np.exp(-0.5 * np.subtract.outer(f, f) ** 2))
    kept = values > MIN_EIGENVALUE * np.max(values)
    return np.sqrt(0.5 * values[kept])[:, None] * vectors[:, kept].T
