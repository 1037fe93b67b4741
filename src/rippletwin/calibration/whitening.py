"""Whitening of residuals by noise, model error and source error."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from rippletwin.calibration.whitening_kernel import prepare, remove_along, rotate

NO_FREQUENCIES, NO_BASIS = np.empty(0, np.int64), np.empty((0, 0))
TINY = 1e-300  # size of a prediction that is nothing at every sensor


class NoiseBasis:
    """Eigenbasis of the sensor noise at each frequency.

    In it the noise and a model error common to all sensors are both diagonal.

    covariance   (F, S, S) Hermitian, E[e e^H]
    variances    (S, F) eigenvalues
    """

    def __init__(self, covariance: np.ndarray):
        variances, basis = np.linalg.eigh(covariance)
        self.variances = np.ascontiguousarray(np.maximum(variances, 0.0).T)
        self.rotation = np.conj(basis)

    def rotate(self, x: np.ndarray) -> np.ndarray:
        """Sensor values x (..., S, F) in the eigenbasis."""
        return rotate(self.rotation, _rows(x)).reshape(x.shape)


class Whitening:
    """Multiplication by an inverse root of the covariance sd^2 + source^2 h h^H + smooth part.

    h         (S, F) prediction
    sd        (S, F) standard deviations of what is independent between sensors
    source    (F,) relative error of the source at each frequency; 0 known, inf free
    nominal   (N,) indices of the frequencies that have a smooth source error as well
    basis     (J, N) basis of that error, in standard deviations

    Both source errors are along h. So the root is the division by sd and then I - u M u^H with
    u = h/sd and a real (F, F) matrix M, diagonal but for a part of rank J.
    """

    def __init__(self, h, sd, source, nominal=NO_FREQUENCIES, basis=NO_BASIS):
        self._sd, self._nominal = sd, nominal
        self._u, self._diagonal, self._left, self._right, self._volume = prepare(
            np.ascontiguousarray(h), sd, source, nominal, basis
        )

    @cached_property
    def log_determinant(self) -> float:
        """Log determinant of the covariance; of a free source only the volume that is left."""
        return 2.0 * float(np.sum(np.log(self._sd))) + self._volume

    def apply(self, x: np.ndarray) -> np.ndarray:
        """x (..., S, F) multiplied by the inverse root."""
        return self._remove(x / self._sd, self._left, self._right)

    def adjoint(self, x: np.ndarray) -> np.ndarray:
        """x (..., S, F) multiplied by the root's adjoint: adjoint(apply(x)) is C^-1 x."""
        return self._remove(x, self._right, self._left) / self._sd

    def pull(self, h: np.ndarray, residual: np.ndarray) -> np.ndarray:
        """Derivative (F,) of the log likelihood by the conjugate of a relative error of h (S, F) at
        each frequency: h^H C^-1 r there.

        residual   (S, F) r, readings less the expected ones
        """
        return np.sum(np.conj(h) * self.adjoint(self.apply(residual)), axis=0)

    def _remove(self, x, left, right):
        rows = remove_along(_rows(x), self._u, self._diagonal, self._nominal, left, right)
        return rows.reshape(x.shape)


def _rows(x: np.ndarray) -> np.ndarray:
    """x (..., S, F) as (N, S, F), complex and contiguous."""
    return np.ascontiguousarray(x, complex).reshape(-1, *x.shape[-2:])


def best_amplitude(values: np.ndarray, h: np.ndarray, variance: np.ndarray) -> np.ndarray:
    """Factor (F,) of h (S, F) at each frequency with which it fits values (S, F) best.

    variance   (S, F) of the values, independent between sensors
    """
    size = np.sum(np.abs(h) ** 2 / variance, axis=0)
    return np.sum(np.conj(h) * values / variance, axis=0) / np.maximum(size, TINY)


def as_real(r: np.ndarray) -> np.ndarray:
    """Complex residuals (..., S, F) of unit variance as real ones (..., 2, S, F).

    The real and the imaginary part have half the variance each, hence the factor sqrt 2.
    """
    return np.sqrt(2.0) * np.stack([r.real, r.imag], axis=-3)
