"""Whitening of residuals by noise, model error and source error."""

from __future__ import annotations

from functools import cached_property

import numpy as np


class NoiseBasis:
    """Eigenbasis of the sensor noise at each frequency.

    In it the noise and a model error common to all sensors are both diagonal.

    covariance   (F, S, S) Hermitian, E[e e^H]
    variances    (S, F) eigenvalues
    """

    def __init__(self, covariance: np.ndarray):
        variances, basis = np.linalg.eigh(covariance)
        self.variances = np.maximum(variances, 0.0).T
        self.rotation = np.conj(basis)

    def rotate(self, x: np.ndarray) -> np.ndarray:
        """Sensor values x (..., S, F) in the eigenbasis."""
        return np.einsum("fsk,...sf->...kf", self.rotation, x)


class Whitening:
    """Multiplication by an inverse root of the covariance sd^2 + source^2 h h^H + smooth part.

    source_log_determinant   log determinant of the covariance over that of sd^2 alone: what the
                             source's error adds, the only part that depends on h

    h         (S, F) prediction
    sd        (S, F) standard deviations of what is independent between sensors
    source    (F,) relative error of the source at each frequency; 0 known, inf free
    nominal   (N,) indices of the frequencies that have a smooth source error as well
    basis     (J, N) basis of that error, in standard deviations; None for none
    """

    def __init__(self, h, sd, source, nominal=(), basis=None):
        self._sd, self._u = sd, h / sd
        self._size = np.maximum(np.sum(np.abs(self._u) ** 2, axis=0), 1e-300)
        free = np.isinf(source)
        source = np.where(free, 0.0, source)
        stretch = 1.0 + source**2 * self._size
        self._shorten = np.where(free, 1.0, 1.0 - 1.0 / np.sqrt(stretch))
        power = np.maximum(np.sum(np.abs(h) ** 2, axis=0), 1e-300)
        volume = np.where(free, self._size / power, stretch)
        self.source_log_determinant = float(np.sum(np.log(volume)))
        # What the readings leave of the variance of each relative source error. Of a free source
        # the amplitude's scale is that of h, which takes away what its size adds.
        self._left = np.where(free, 1.0 / self._size, source**2 / stretch)
        self._scale = np.where(free, 1.0 / power, 0.0)
        self._part, self._columns = nominal, None
        if basis is not None and np.any(basis):
            # Whitened so far, the smooth error is B c with unit c: I + B B^H in the span of B.
            gram = (basis * (self._size / stretch)[nominal]) @ basis.T
            grown, turn = np.linalg.eigh(gram)
            grown = np.maximum(grown, 1e-12)
            columns = (turn / np.sqrt(grown)).T @ basis  # orthonormal over (S, N) with u
            self._columns = columns[:, None, :] * (self._u / np.sqrt(stretch))[:, nominal]
            self._reduce = 1.0 - 1.0 / np.sqrt(1.0 + grown)
            self.source_log_determinant += float(np.sum(np.log1p(grown)))
            smooth = np.sum((turn.T @ basis) ** 2 / (1.0 + grown)[:, None], axis=0)
            self._left[nominal] += smooth / stretch[nominal] ** 2

    @cached_property
    def log_determinant(self) -> float:
        """Log determinant of the covariance; of a free source only the volume that is left."""
        return 2.0 * float(np.sum(np.log(self._sd))) + self.source_log_determinant

    def determinant_slopes(self, slopes: np.ndarray) -> np.ndarray:
        """Derivatives (B,) of the log determinant, given those (B, S, F) of h.

        d log det C = tr(C^-1 dC), with C = sd^2 + h S h^H and S the covariance of the source's
        relative errors, is 2 Re sum P conj(h) dh / sd^2, P the variances that the readings leave
        of those errors.
        """
        pull = self._left * self._u / self._sd - self._scale * self._u * self._sd
        return 2.0 * np.einsum("sf,bsf->b", np.conj(pull), slopes).real

    def apply(self, x: np.ndarray) -> np.ndarray:
        """x (..., S, F) multiplied by the inverse root."""
        return self._shorten_smooth(self._shorten_rough(x / self._sd))

    def adjoint(self, x: np.ndarray) -> np.ndarray:
        """x (..., S, F) multiplied by the root's adjoint: adjoint(apply(x)) is C^-1 x."""
        return self._shorten_rough(self._shorten_smooth(x)) / self._sd

    def _shorten_rough(self, y):
        along = np.sum(np.conj(self._u) * y, axis=-2) / self._size
        return y - (self._shorten * along)[..., None, :] * self._u

    def _shorten_smooth(self, y):
        if self._columns is None:
            return y
        y = y.copy()
        piece = y[..., self._part].reshape(*y.shape[:-2], -1)
        columns = self._columns.reshape(len(self._columns), -1)
        share = (piece @ np.conj(columns).T) * self._reduce
        y[..., self._part] = (piece - share @ columns).reshape(*y.shape[:-1], -1)
        return y


def as_real(r: np.ndarray) -> np.ndarray:
    """Complex residuals (..., S, F) of unit variance as real ones (..., 2, S, F).

    The real and the imaginary part have half the variance each, hence the factor sqrt 2.
    """
    return np.sqrt(2.0) * np.stack([r.real, r.imag], axis=-3)
