"""Costs of error sizes against the dense Gaussian that they stand for."""

import numpy as np
import pytest

from rippletwin.calibration.error_costs import error_costs

MODEL_ERRORS, SDS, SMOOTH_SDS = np.array([0.02, 0.3]), np.array([0.1, 1.0]), np.array([0.05, 0.4])


def make(scale_of_source):
    """Arguments of `error_costs` for two sensors and five frequencies, three of them with a smooth
    error of two functions."""
    rng = np.random.default_rng(1)
    residual, h = (rng.normal(size=(2, 5, 2)) @ np.array([1, 1j]) for _ in range(2))
    variance, power = rng.uniform(0.5, 2.0, size=(2, 5)), rng.uniform(0.5, 2.0, size=5)
    nominal, basis = np.array([0, 2, 3]), rng.normal(size=(2, 3))
    smooth_sds = np.stack([SMOOTH_SDS, np.full(2, 0.03)], axis=1)
    source = np.array(scale_of_source, float)
    return residual, h, variance, power, source, nominal, basis, MODEL_ERRORS, SDS, smooth_sds


def dense_cost(arguments, smooth, sd, model_error):
    """Twice minus the log density of a complex Gaussian, but for a constant."""
    residual, h, variance, power, source, nominal, basis, _, _, smooth_sds = arguments
    functions = np.zeros((2, h.shape[1]))
    functions[:, nominal] = basis * smooth_sds[smooth][:, None]
    kernel = np.diag((source * sd) ** 2) + functions.T @ functions
    covariance = np.outer(h.ravel(), h.ravel().conj()) * np.tile(kernel, (2, 2))
    covariance += np.diag((variance + model_error**2 * power).ravel())
    square = np.vdot(residual.ravel(), np.linalg.solve(covariance, residual.ravel())).real
    return square + np.linalg.slogdet(covariance)[1]


def test_costs_are_those_of_the_dense_gaussian():
    """Sum of squares and log determinant, a frequency with a known source among them."""
    arguments = make([1.0, 0.0, 2.0, 0.5, 1.0])
    costs = error_costs(*arguments, 1.0)
    for t in range(2):
        for g, sd in enumerate(SDS):
            for d, model_error in enumerate(MODEL_ERRORS):
                assert costs[t, g, d] == pytest.approx(dense_cost(arguments, t, sd, model_error))


def test_a_free_source_is_the_limit_of_a_very_uncertain_one():
    """Projected out, a source costs what an uncertainty of 1e5 costs less the log of its square."""
    free, uncertain = make([1.0, np.inf, 2.0, 0.5, 1.0]), make([1.0, 1e5, 2.0, 0.5, 1.0])
    less = 2.0 * np.log(1e5 * SDS)[None, :, None]
    assert np.allclose(error_costs(*free, 1.0), error_costs(*uncertain, 1.0) - less, atol=1e-6)
