"""The likelihood with unknown amplitudes integrated out.

Independent truth: the dense covariance of the real residuals.
"""

import numpy as np

from rippletwin.diagnosis.likelihood import complex_columns, marginalise


def dense(residual, variance, columns):
    """Log likelihood, square and conditional mean of the amplitudes, by the whole covariance."""

    def parts(x):
        return np.concatenate([x.real.ravel(), x.imag.ravel()])

    b = np.array([parts(c) for c in columns]).T
    noise = np.tile(variance.ravel() / 2.0, 2)
    covariance = np.diag(noise) + b @ b.T
    r = parts(residual)
    solved = np.linalg.solve(covariance, r)
    value = -0.5 * (r @ solved + np.linalg.slogdet(2 * np.pi * covariance)[1])
    return value, r @ solved, b.T @ solved


def test_marginal_is_that_of_the_whole_covariance():
    """Log likelihood, square and amplitudes agree with the dense formulas to rounding."""
    rng = np.random.default_rng(0)

    def draw(*shape):
        return rng.normal(size=shape) + 1j * rng.normal(size=shape)

    residual, columns = draw(2, 7), np.concatenate([draw(1, 2, 7), complex_columns(draw(2, 2, 7))])
    variance = rng.uniform(0.1, 2.0, (2, 7))
    found = marginalise(residual, variance, columns)
    value, square, amplitudes = dense(residual, variance, columns)
    np.testing.assert_allclose(found.log_likelihood, value, rtol=1e-12)
    np.testing.assert_allclose(found.square, square, rtol=1e-12)
    np.testing.assert_allclose(found.amplitudes, amplitudes, rtol=1e-10)


def test_readings_that_are_alike_count_as_one():
    """Each reading there three times, its error too: nothing is learnt from the copies."""
    rng = np.random.default_rng(1)
    residual, column = rng.normal(size=(2, 1, 2, 5)) + 1j * rng.normal(size=(2, 1, 2, 5))
    variance = rng.uniform(0.1, 2.0, (2, 5))
    once = marginalise(residual[0], variance, column)
    copied = [np.repeat(x, 3, axis=-1) for x in (residual[0], variance, column)]
    found = marginalise(*copied, alike=3.0)
    np.testing.assert_allclose(found.log_likelihood, once.log_likelihood, rtol=1e-12)
    np.testing.assert_allclose(found.amplitudes, once.amplitudes, rtol=1e-10)
    np.testing.assert_allclose(found.square, 3.0 * once.square, rtol=1e-10)


def test_complex_columns_span_any_phase_with_unit_variance():
    """The two real amplitudes of a complex column give it mean square one and no favoured phase."""
    column = np.array([[[1.0 + 2.0j]]])
    both = complex_columns(column)
    covariance = sum(np.outer([c.real, c.imag], [c.real, c.imag]) for c in both.ravel())
    np.testing.assert_allclose(covariance, 0.5 * abs(1 + 2j) ** 2 * np.eye(2))
