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
        stretch = 1.0 + np.where(free, 0.0, source) ** 2 * self._size
        self._shorten = np.where(free, 1.0, 1.0 - 1.0 / np.sqrt(stretch))
        power = np.sum(np.abs(h) ** 2, axis=0)
        self._volume = np.where(free, self._size / np.maximum(power, 1e-300), stretch)
        self._part, self._columns, self._grown = nominal, None, np.zeros(0)
        if basis is not None and np.any(basis):
            # Whitened so far, the smooth error is B c with unit c: I + B B^H in the span of B.
            gram = (basis * (self._size / stretch)[nominal]) @ basis.T
            grown, turn = np.linalg.eigh(gram)
            grown = np.maximum(grown, 1e-12)
            columns = (turn / np.sqrt(grown)).T @ basis  # orthonormal over (S, N) with u
            self._columns = columns[:, None, :] * (self._u / np.sqrt(stretch))[:, nominal]
            self._reduce = 1.0 - 1.0 / np.sqrt(1.0 + grown)
            self._grown = grown

    @cached_property
    def log_determinant(self) -> float:
        """Log determinant of the covariance; of a free source only the volume that is left."""
        rough = 2.0 * np.sum(np.log(self._sd)) + np.sum(np.log(self._volume))
        return float(rough + np.sum(np.log1p(self._grown)))

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
