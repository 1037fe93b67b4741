"""The most likely smooth error of a source, against a dense posterior and a general optimiser."""

import numpy as np
import pytest
from scipy.optimize import minimize

from rippletwin.calibration.smooth_source import SmoothSourceError
from rippletwin.calibration.source_expansion import SourceData, find_most_likely_expansion

TAU, SENSORS, STEPS = 0.4, 2, 20


@pytest.fixture
def data():
    """Readings of two sensors in two recordings whose source errs smoothly by up to a factor 2; at
    two frequencies the source is known."""
    rng = np.random.default_rng(7)
    frequency_hz = np.tile(np.linspace(150.0, 4000.0, 20), 2)
    nominal = np.ones(40, bool)
    nominal[[3, 25]] = False
    smooth = SmoothSourceError(frequency_hz, np.repeat([0, 1], 20), nominal, 0.03)
    amplitudes = smooth.sds(TAU) * (rng.normal(size=(len(smooth.basis), 2)) @ [1.0, 1j]) / 2.0
    prediction = rng.normal(size=(SENSORS, 40, 2)) @ np.array([1.0, 1j])
    noise = rng.normal(size=(SENSORS, 40, 2)) @ np.array([1.0, 1j])
    sd = np.full((SENSORS, 40), 0.02)
    values = prediction * np.exp(smooth.error(amplitudes)) + sd * noise / np.sqrt(2.0)
    return SourceData(values, prediction, sd, np.where(nominal, 0.05, 0.0), smooth, TAU), amplitudes


def dense_cost(data, amplitudes, about):
    """Minus the log posterior of amplitudes, with dense covariances of each frequency in which the
    independent error is a share of the source as `about` leaves it."""
    source = np.exp(data.smooth.error(amplitudes))
    h = data.prediction * np.exp(data.smooth.error(about))
    cost = np.sum(np.abs(amplitudes / data.smooth.sds(data.tau)) ** 2)
    for f in range(data.values.shape[1]):
        covariance = np.diag(data.sd[:, f] ** 2).astype(complex)
        covariance += data.independent[f] ** 2 * np.outer(h[:, f], np.conj(h[:, f]))
        r = data.values[:, f] - data.prediction[:, f] * source[f]
        cost += (np.conj(r) @ np.linalg.solve(covariance, r)).real
    return cost


def test_no_other_smooth_error_is_likelier(data):
    """Proves that a general optimiser, begun where the steps end, finds nothing better than what
    the last step may leave, and that the error is the true one to the noise."""
    data, truth = data
    found = find_most_likely_expansion(data, data.smooth.without_error(), STEPS)
    about = found.amplitudes

    def cost(x):
        return dense_cost(data, x[: len(about)] + 1j * x[len(about) :], about)

    start = np.concatenate([about.real, about.imag])
    best = minimize(cost, start, method="BFGS")
    assert cost(start) - best.fun < 0.1
    assert dense_cost(data, np.zeros_like(about), about) > cost(start) + 100.0
    error = data.smooth.error(about) - data.smooth.error(truth)
    assert np.max(np.abs(error)) < 0.15 < np.max(np.abs(data.smooth.error(truth)))


def test_an_expansion_is_the_factor_and_its_slope(data):
    """Proves factor and mean of the result against the exponential of its own error, and that a
    known source has none."""
    data, _ = data
    found = find_most_likely_expansion(data, data.smooth.without_error(), STEPS)
    error = data.smooth.error(found.amplitudes)
    np.testing.assert_allclose(found.factor, np.exp(error))
    np.testing.assert_allclose(found.mean + found.factor * error, np.exp(error))
    np.testing.assert_array_equal(found.factor[[3, 25]], 1.0)


def test_an_error_that_makes_no_number_is_not_taken(data):
    """Proves that steps end where they began if none gains, also where the readings are beyond all
    numbers."""
    data, _ = data
    start = data.smooth.without_error()
    broken = data._replace(values=np.full_like(data.values, np.nan))
    found = find_most_likely_expansion(broken, start, STEPS)
    np.testing.assert_array_equal(found.amplitudes, start.amplitudes)
