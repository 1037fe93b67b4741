"""The linear model with a correction, against dense matrices."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from rippletwin.explanation.localise.linear_model import LinearModel

AMPLITUDES = np.array([0.05, 0.3, 2.0])


@pytest.fixture
def parts():
    """Residual (30,), columns of the model (5, 30) and of the correction (4, 30)."""
    rng = np.random.default_rng(0)
    return rng.normal(size=30), rng.normal(size=(5, 30)), rng.normal(size=(4, 30))


def test_likelihoods_are_those_of_the_dense_covariance(parts):
    """Proves the reduction against scipy's multivariate normal density, for several amplitudes of a
    correction and without one."""
    r, columns, changes = parts
    constant = 15.0 * np.log(2.0 * np.pi)
    model = LinearModel(r, columns)
    plain = np.eye(30) + columns.T @ columns
    values = model.with_correction(changes).log_likelihoods(AMPLITUDES)
    for a, value in zip([0.0, *AMPLITUDES], [model.log_likelihood, *values]):
        dense = multivariate_normal(np.zeros(30), plain + a**2 * changes.T @ changes)
        assert value - constant == pytest.approx(dense.logpdf(r))
    none = model.with_correction(np.empty((0, 30)))
    assert none.log_likelihoods(np.zeros(1)) == pytest.approx([model.log_likelihood])


def test_the_most_likely_coefficients_solve_the_whole_least_squares_problem(parts):
    """Proves coefficients and least sum of squares against one solution for all at once."""
    r, columns, changes = parts
    corrected = LinearModel(r, columns).with_correction(changes)
    for a in AMPLITUDES:
        x, w, half = corrected.most_likely(a)
        rows = np.vstack([np.column_stack([columns.T, a * changes.T]), np.eye(9)])
        right = np.concatenate([-r, np.zeros(9)])
        found, (square,) = np.linalg.lstsq(rows, right, rcond=None)[:2]
        np.testing.assert_allclose(np.concatenate([x, w / a]), found, rtol=1e-9)
        assert half == pytest.approx(0.5 * square)
