"""Likelihood of a linear model whose coefficients are normal, with a correction of any amplitude.

    r + A^T x + B^T w,    x ~ N(0, I),    w ~ N(0, a^2 I),

is white noise of unit variance. A is common to many corrections B, so x is integrated out once.
What remains of B beside A is diagonalised, so that each amplitude a takes a sum over K numbers
(Rasmussen and Williams 2006, Gaussian Processes for Machine Learning, eq. 2.30).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular


class LinearModel:
    """The model without a correction.

    residual        (N,) r
    columns         (P, N) A
    log_likelihood  of r without a correction, but for a constant
    """

    def __init__(self, residual: np.ndarray, columns: np.ndarray):
        self.residual, self.columns = residual, columns
        self._root = np.linalg.cholesky(columns @ columns.T + np.eye(len(columns)))
        self._along = self._solve(columns @ residual)
        square = float(residual @ residual - self._along @ self._along)
        self.log_likelihood = -0.5 * square - float(np.sum(np.log(np.diagonal(self._root))))

    def with_correction(self, changes: np.ndarray) -> Correction:
        """The model with a correction, `changes` (K, N) B."""
        cross = self._solve(self.columns @ changes.T)
        beside = changes @ changes.T - cross.T @ cross
        sizes, axes = np.linalg.eigh(beside)
        along = axes.T @ (changes @ self.residual - cross.T @ self._along)
        return Correction(self, changes, cross, np.maximum(sizes, 0.0), axes, along)

    def most_likely(self, pull: np.ndarray) -> np.ndarray:
        """The most likely x (P,) beside a correction that contributes `pull` (P,) to the right side
        of its equations, in the basis of `cross`."""
        return -solve_triangular(self._root, self._along + pull, lower=True, trans=1)

    def _solve(self, right: np.ndarray) -> np.ndarray:
        return solve_triangular(self._root, right, lower=True)


class Correction(NamedTuple):
    """A correction of a model, made by `LinearModel.with_correction`.

    changes   (K, N) B
    cross     (P, K) A B^T, multiplied by the inverse root of I + A A^T
    sizes     (K,) eigenvalues of what remains of B B^T beside A
    axes      (K, K) its eigenvectors, in columns
    along     (K,) what remains of B r beside A, along these
    """

    model: LinearModel
    changes: np.ndarray
    cross: np.ndarray
    sizes: np.ndarray
    axes: np.ndarray
    along: np.ndarray

    def log_likelihoods(self, amplitudes: np.ndarray) -> np.ndarray:
        """Log likelihood (M,) of r at amplitudes a (M,), but for the same constant."""
        squares = amplitudes[:, None] ** 2
        stretch = 1.0 + squares * self.sizes
        gain = squares * self.along**2 / stretch - np.log(stretch)
        return self.model.log_likelihood + 0.5 * np.sum(gain, axis=1)

    def most_likely(self, amplitude: float) -> tuple[np.ndarray, np.ndarray, float]:
        """The most likely x (P,) and w (K,) at an amplitude, and half the sum of squares there:
        of what is left of r, of x, and of w over the amplitude."""
        square = amplitude**2
        w = -self.axes @ (square * self.along / (1.0 + square * self.sizes))
        x, r = self.model.most_likely(self.cross @ w), self.model.residual
        left = float(r @ r + r @ (self.model.columns.T @ x + self.changes.T @ w))
        return x, w, 0.5 * left
