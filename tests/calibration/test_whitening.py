"""The compiled whitening against the dense covariance and the root that it stands for."""

import numpy as np
import pytest

from rippletwin.calibration.whitening import NoiseBasis, Whitening

SENSORS, FREQUENCIES = 2, 5
NOMINAL = np.array([0, 2, 3])


def complex_normal(rng, *shape):
    return rng.normal(size=(*shape, 2)) @ np.array([1.0, 1j])


def make(source):
    """Arguments of a `Whitening` of two sensors and five frequencies, three of them with a smooth
    error of two functions."""
    rng = np.random.default_rng(4)
    h, sd = complex_normal(rng, 2, 5), rng.uniform(0.3, 1.0, size=(2, 5))
    return h, sd, np.array(source, float), NOMINAL, 0.5 * rng.normal(size=(2, 3))


def dense(h, sd, source, nominal, basis):
    """Covariance of the readings in the order of h.ravel()."""
    functions = np.zeros((len(basis), h.shape[1]))
    functions[:, nominal] = basis
    errors = np.diag(source**2) + functions.T @ functions
    along = np.outer(h.ravel(), h.ravel().conj()) * np.tile(errors, (2, 2))
    return np.diag(sd.ravel() ** 2) + along


def root_by_numpy(x, h, sd, source, nominal, basis):
    """x (S, F) multiplied by the inverse root: first of noise and of the source's error at each
    frequency, then of what the smooth error still adds."""
    u = h / sd
    size = np.sum(np.abs(u) ** 2, axis=0)
    stretch = 1.0 + np.where(np.isinf(source), 0.0, source) ** 2 * size
    shorten = np.where(np.isinf(source), 1.0, 1.0 - 1.0 / np.sqrt(stretch))
    y = x / sd
    y = y - shorten / size * np.sum(np.conj(u) * y, axis=0) * u
    smooth = (basis[:, None, :] * (u / np.sqrt(stretch))[:, nominal]).reshape(len(basis), -1).T
    covariance = np.eye(len(smooth)) + smooth @ smooth.conj().T
    values, vectors = np.linalg.eigh(covariance)
    inverse_root = (vectors / np.sqrt(values)) @ vectors.conj().T
    y[:, nominal] = (inverse_root @ y[:, nominal].ravel()).reshape(len(x), -1)
    return y


@pytest.mark.parametrize("source", [[1.0, 0.0, 0.4, 0.1, 2.0], [0.3, np.inf, 0.4, 0.1, 2.0]])
def test_the_root_is_that_of_numpy(source):
    """Of one row and of several at once, with a free source and without."""
    arguments = make(source)
    x = complex_normal(np.random.default_rng(5), 3, SENSORS, FREQUENCIES)
    expected = np.stack([root_by_numpy(row, *arguments) for row in x])
    whitening = Whitening(*arguments)
    assert np.allclose(whitening.apply(x), expected, rtol=1e-12, atol=1e-13)
    assert np.allclose(whitening.apply(x[0]), expected[0], rtol=1e-12, atol=1e-13)


def test_square_and_determinant_are_those_of_the_dense_covariance():
    """adjoint(apply(x)) is C^-1 x, and the log determinant is that of C."""
    arguments = make([1.0, 0.0, 0.4, 0.1, 2.0])
    covariance, whitening = dense(*arguments), Whitening(*arguments)
    x = complex_normal(np.random.default_rng(6), SENSORS, FREQUENCIES)
    solved = np.linalg.solve(covariance, x.ravel()).reshape(x.shape)
    assert np.allclose(whitening.adjoint(whitening.apply(x)), solved, rtol=1e-11)
    log_determinant = np.linalg.slogdet(covariance)[1]
    assert whitening.log_determinant == pytest.approx(log_determinant, rel=1e-12)


def test_without_a_smooth_error_frequencies_are_apart():
    """The default has none: the root is that of each frequency alone."""
    h, sd, source, *_ = make([1.0, 0.0, 0.4, 0.1, 2.0])
    none = NOMINAL[:0], np.empty((0, 0))
    x = complex_normal(np.random.default_rng(7), SENSORS, FREQUENCIES)
    whitened = Whitening(h, sd, source).apply(x)
    for f in range(FREQUENCIES):
        one = Whitening(h[:, [f]], sd[:, [f]], source[[f]], *none).apply(x[:, [f]])
        assert np.allclose(whitened[:, [f]], one, rtol=1e-13)


def test_the_basis_of_the_noise_makes_it_independent():
    """Rotated, noise of covariance C has the covariance diag(variances) at each frequency."""
    rng = np.random.default_rng(8)
    root = complex_normal(rng, FREQUENCIES, SENSORS, SENSORS)
    noise = NoiseBasis(root @ np.conj(np.swapaxes(root, 1, 2)))
    columns = noise.rotate(np.moveaxis(root, 0, 2).swapaxes(0, 1))  # E[e e^H] is their sum
    covariance = np.einsum("nsf,ntf->fst", columns, columns.conj())
    expected = np.einsum("sf,st->fst", noise.variances, np.eye(SENSORS))
    assert np.allclose(covariance, expected, atol=1e-12)
