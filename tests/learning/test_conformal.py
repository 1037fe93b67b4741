"""Conformal p-values keep their promise on exchangeable data and find what is far away."""

import numpy as np
import pytest

from rippletwin.learning.conformal import PROMISED_RATE, fit_conformal

CLASSES, WIDTH = 3, 16


def features(rng, count, away=0.0):
    """Heavy-tailed clusters of correlated features, one of which is always silent."""
    labels = rng.integers(CLASSES, size=count)
    mixing = np.random.default_rng(9).normal(size=(WIDTH, WIDTH))
    noise = rng.standard_t(4, size=(count, WIDTH)) @ mixing
    centres = 6.0 * np.random.default_rng(8).normal(size=(CLASSES, WIDTH))
    x = centres[labels] + noise + away
    x[:, -1] = 0.0
    return x, labels


def fitted(rng, held_out=99):
    return fit_conformal(*features(rng, 300), features(rng, held_out)[0])


def test_the_promised_rate_holds_on_exchangeable_data():
    """Over 300 calibrations of 99 samples the mean rate of false alarms is the promised one, which
    is 5 / 100 exactly for distances without ties, within four standard errors."""
    rng = np.random.default_rng(0)
    rates = [
        np.mean(fitted(rng).p_values(features(rng, 100)[0]) <= PROMISED_RATE) for _ in range(300)
    ]
    error = np.std(rates) / np.sqrt(len(rates))
    assert abs(np.mean(rates) - 0.05) < 4 * error and error < 0.003


def test_a_network_that_knows_its_training_samples_keeps_the_promise():
    """Means and covariance of 20 samples in 16 dimensions fit those 20 too well; the held-out ones
    set the threshold, so the rate holds all the same."""
    rng = np.random.default_rng(1)
    rates = []
    for _ in range(200):
        conformal = fit_conformal(*features(rng, 20), features(rng, 99)[0])
        rates.append(np.mean(conformal.p_values(features(rng, 50)[0]) <= PROMISED_RATE))
    assert abs(np.mean(rates) - 0.05) < 4 * np.std(rates) / np.sqrt(len(rates))


def test_far_away_data_are_caught():
    """All windows far from every class have the smallest p-value there is."""
    rng = np.random.default_rng(2)
    conformal = fitted(rng)
    p = conformal.p_values(features(rng, 200, away=500.0)[0])
    assert (p == 1 / 100).all()


def test_a_feature_that_was_silent_and_speaks_is_caught():
    """A direction without any variance among the simulated samples is no blind spot."""
    rng = np.random.default_rng(3)
    conformal = fitted(rng)
    x, _ = features(rng, 100)
    x[:, -1] = 20.0
    assert np.mean(conformal.p_values(x) <= PROMISED_RATE) > 0.9


def test_the_distance_is_mahalanobis_to_the_nearest_class():
    """Two clusters of known covariance: by hand, two standard deviations along either axis."""
    rng = np.random.default_rng(4)
    spread = np.array([1.0, 10.0])
    centres = np.array([[0.0, 0.0], [100.0, 0.0]])
    labels = np.repeat([0, 1], 20000)
    x = centres[labels] + rng.normal(size=(40000, 2)) * spread
    conformal = fit_conformal(x, labels, x[:100])
    found = conformal.distance(np.array([[2.0, 0.0], [100.0, 20.0], [98.0, 0.0]]))
    np.testing.assert_allclose(found, 2.0, rtol=0.05)


def test_too_few_held_out_samples_promise_nothing():
    """Ten samples cannot tell one window in twenty."""
    rng = np.random.default_rng(5)
    with pytest.raises(ValueError, match="promise"):
        fitted(rng, held_out=10)
