"""Gaussian likelihood of complex residuals with independent errors and a few directions besides.

Errors of variance v (circular: half of it in either part) and directions b_j that an unknown real
amplitude of unit variance may take, r = e + sum_j a_j b_j. Amplitudes are integrated out in closed
form (Bishop 2006, Pattern Recognition and Machine Learning, eq. 2.115), with Woodbury's identity.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Marginal(NamedTuple):
    """Log likelihood with the amplitudes integrated out, their most likely values (J,), and the
    square of the residual in units of its covariance: the count of real residuals is expected."""

    log_likelihood: float
    amplitudes: np.ndarray
    square: float


def marginalise(
    residual: np.ndarray, variance: np.ndarray, columns: np.ndarray, alike: float = 1.0
) -> Marginal:
    """Of residuals (S, F) with errors of `variance` (S, F) and directions `columns` (J, S, F).

    Errors of which about `alike` go together count as one: the log likelihood of independent errors
    is divided by it (composite likelihood; Pauli, Racugno and Ventura 2011, Statistica Sinica 21).
    """
    root = 1.0 / np.sqrt(alike * variance)
    r = (residual * root).ravel()
    b = (columns * root).reshape(len(columns), r.size)
    # Real amplitudes: the inner product of two complex columns is twice its real part.
    b, r = _parts(b), _parts(r)
    precision = np.eye(len(b)) + b @ b.T
    factor = np.linalg.cholesky(precision)
    along = np.linalg.solve(factor, b @ r)
    amplitudes = np.linalg.solve(factor.T, along)
    square = float(r @ r - along @ along)
    value = -0.5 * square
    value -= np.sum(np.log(np.pi * variance)) / alike + np.sum(np.log(np.diag(factor)))
    return Marginal(float(value), amplitudes, alike * square)


def _parts(x: np.ndarray) -> np.ndarray:
    """Complex numbers (..., N) of unit variance as real ones (..., 2 N) of unit variance."""
    return np.sqrt(2.0) * np.concatenate([x.real, x.imag], axis=-1)


def complex_columns(columns: np.ndarray) -> np.ndarray:
    """Directions (2 J, ...) for complex amplitudes of unit variance along `columns` (J, ...)."""
    return np.concatenate([columns, 1j * columns]) / np.sqrt(2.0)
