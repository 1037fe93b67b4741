"""The error model of explaining against its definition."""

from dataclasses import replace

import numpy as np
import pytest

from rippletwin.calibration.posterior import Posterior
from rippletwin.calibration.reading_errors import SIZE_SD
from rippletwin.calibration.smooth_source import source_scale
from synthetic_observations import POINTS, make


def test_whitened_residual_of_the_truth_has_unit_variance():
    """At the true parameters, with noise alone, the residuals have mean square 1 (chi-square)."""
    _, observations, truth = make(np.random.default_rng(2), source=0.0, noise=4e5)
    posterior = Posterior(truth, observations)
    posterior.model_error, posterior.source_sd = 0.0, 0.0
    r = posterior.whitened(posterior.predict(truth.theta))[0]
    assert abs(np.mean(np.abs(r) ** 2) - 1) < 5 / np.sqrt(r.size)


def test_source_free_residual_ignores_the_amplitude_of_the_source():
    """Any complex factor of the source at each frequency leaves the source-free residual alone."""
    rng = np.random.default_rng(3)
    _, observations, truth = make(rng)
    posterior = Posterior(truth, observations, source_free=True)
    prediction = posterior.predict(truth.theta)
    other = prediction * np.exp(rng.normal(size=prediction.shape[1]) * 1j) * 1.7
    np.testing.assert_allclose(
        np.abs(posterior.whitened(prediction)[0]) ** 2,
        np.abs(posterior.whitened(other)[0]) ** 2,
        atol=1e-6,
    )


def test_independent_errors_leave_each_frequency_alone():
    """What a correction at one frequency does to the whitened residual is at that frequency, behind
    a nominal source too, whose ripple may be of another size."""
    _, observations, truth = make(np.random.default_rng(3), points=POINTS[:2])
    posterior = Posterior(truth, observations)
    prediction = posterior.predict(truth.theta)
    posterior.estimate_errors(prediction, truth.theta)
    slopes = np.zeros((1, *prediction.shape), complex)
    slopes[..., 7] = prediction[:, 7]

    def elsewhere():
        _, columns = posterior.whiten_slopes(prediction, slopes)
        whitened = np.abs(columns.reshape(2, *prediction.shape)).max(axis=(0, 1))
        return np.delete(whitened, 7).max() / whitened[7]

    assert elsewhere() > 1e-3
    posterior.make_errors_independent(prediction)
    assert elsewhere() < 1e-12


def test_log_likelihood_is_that_of_the_whole_covariance_matrix():
    """Sum of squares and log determinant of the whitened residual equal those of one dense Gaussian
    with noise, model error and the source's error (independent, smooth, of size) over all sensors,
    frequencies and recordings."""
    rng = np.random.default_rng(12)
    _, observations, truth = make(rng, points=POINTS[:2])
    posterior = Posterior(truth, observations, 2000.0)
    posterior.model_error, posterior.source_sd, posterior.smooth_sd = 0.02, 0.03, 0.1
    prediction = posterior.predict(truth.theta + 0.05 * rng.normal(size=len(truth.theta)))
    f, recording = posterior.forward.frequency_hz, posterior.forward.recording
    kernel = (1 + np.outer(f, f) / 1e6) * np.exp(-0.5 * np.subtract.outer(f, f) ** 2 / 1e6)
    kernel += 1.0
    kernel *= 0.5 + 0.5 * (recording[:, None] == recording)
    scale = [source_scale(posterior.forward.source.flow[part]) for part in posterior.forward.slices]
    independent = np.diag((0.03 * np.concatenate(scale)) ** 2)
    source = independent + 0.1**2 * kernel + SIZE_SD**2
    h, sensors = prediction.ravel(), len(prediction)
    dense = np.outer(h, h.conj()) * np.kron(np.ones((sensors, sensors)), source)
    noise = np.concatenate([o.covariance[:, 0, 0].real for o in posterior.observations])
    dense += np.diag(np.tile(noise + 0.02**2 * posterior.power, sensors))
    e = (posterior.values - prediction).ravel()
    r, log_determinant = posterior.whitened(prediction)
    square = np.sum(np.abs(r) ** 2)
    assert square == pytest.approx((e.conj() @ np.linalg.solve(dense, e)).real, rel=2e-3)
    # The kernel is cut at 0.1 % of its largest eigenvalue; evidence is compared in whole units.
    assert log_determinant == pytest.approx(np.linalg.slogdet(dense)[1], abs=0.7)


@pytest.mark.parametrize("source_free", [False, True])
def test_gradient_is_that_of_the_objective(source_free):
    """Residual and Jacobian give the change of the objective by difference quotients in any
    direction of the prediction, with source and covariance held."""
    _, observations, truth = make(np.random.default_rng(8))
    posterior = Posterior(truth, observations, None, source_free)
    theta = truth.theta + 0.05
    h = posterior.predict(theta)
    posterior.estimate_errors(h, theta)
    rng = np.random.default_rng(9)
    ways = 0.1 * np.abs(h).mean() * (rng.normal(size=(5, *h.shape, 2)) @ np.array([1, 1j]))
    r, jacobian = posterior.linearise(theta, h, ways)
    gradient = (jacobian.T @ r)[len(theta) :]
    step = 1e-5
    quotients = [
        (posterior.objective(theta, h + step * d) - posterior.objective(theta, h - step * d))
        / (2 * step)
        for d in ways
    ]
    tolerance = 1e-4 * np.max(np.abs(quotients))
    np.testing.assert_allclose(gradient, quotients, rtol=1e-5, atol=tolerance)


@pytest.mark.parametrize("attenuation", [0.0, 0.4, 1.2])
def test_the_likeliest_size_of_a_prediction_is_the_true_one(attenuation):
    """The true line predicts ripples whose source is wrong: by a smooth error, and because it loses
    a share that grows with frequency, up to 70 % at 4 kHz. Over twelve draws the size of the
    prediction that is likeliest is 1 on average. With an error that is normal and not in an
    exponent it is 0.98, 0.79 and 0.51."""
    shares, sizes = np.linspace(0.9, 1.1, 41), []
    for seed in range(12):
        _, observations, truth = make(np.random.default_rng(seed), source=0.1, noise=1.0)
        lost = [np.exp(-attenuation * o.frequency_hz / 4000.0) for o in observations]
        observations = [replace(o, values=o.values * x) for o, x in zip(observations, lost)]
        posterior = Posterior(truth, observations)
        h, size = posterior.predict(truth.theta), 1.0
        for _ in range(12):
            posterior.estimate_errors(size * h, truth.theta)
            costs = [posterior.objective(truth.theta, size * share * h) for share in shares]
            size *= shares[int(np.argmin(costs))]
        sizes.append(size)
    assert abs(np.mean(sizes) - 1.0) < 3.0 * np.std(sizes) / np.sqrt(len(sizes)), sizes


def test_the_source_found_is_the_true_one():
    """With little noise the most likely source is the one that made the readings, also where it
    has a third of the nominal ripple and lags it by half a turn: readings divided by the prediction
    say so at every frequency."""
    _, observations, truth = make(np.random.default_rng(5), source=0.0, noise=1.0)
    factors = [np.exp(-(0.3 + 0.8j) * o.frequency_hz / 1000.0) for o in observations]
    observations = [replace(o, values=o.values * x) for o, x in zip(observations, factors)]
    posterior = Posterior(truth, observations)
    h = posterior.predict(truth.theta)
    posterior.estimate_errors(h, truth.theta)
    found, true = posterior.most_likely_source(h), np.concatenate(factors)
    assert np.max(np.abs(found / true - 1.0)) < 0.02
    assert posterior.source_sd < 0.01
