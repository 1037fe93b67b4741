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
    """The covariance of 20 samples in 16 dimensions fits those 20 too well; the held-out ones set
    the threshold, so the rate holds all the same."""
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


def test_nonconformity_is_a_ratio_of_distances():
    """By hand on a line of samples one apart: in their midst 1.2 over a mean of 1.8, and ten beyond
    their end 12 over a mean of 2.12."""
    x = np.arange(21.0)[:, None]
    conformal = fit_conformal(x, np.zeros(21, int), x)
    found = conformal.nonconformity(np.array([[10.0], [30.0]]))
    np.testing.assert_allclose(found, [1.2 / 1.8, 12 / 2.12])


def test_directions_count_by_their_spread_within_a_class():
    """Two clusters far apart, wide in one direction: in the distance's coordinates each has unit
    deviation in both directions."""
    rng = np.random.default_rng(4)
    spread = np.array([1.0, 10.0])
    labels = np.repeat([0, 1], 2000)
    x = np.array([[0.0, 0.0], [1000.0, 0.0]])[labels] + rng.normal(size=(4000, 2)) * spread
    conformal = fit_conformal(x, labels, x[:100])
    apart = conformal.learnt[:2000].std(axis=0)
    np.testing.assert_allclose(np.sort(apart), 1.0, rtol=0.1)


def test_many_features_are_still_kept_apart():
    """A thousand features, more than samples: the promise holds, and a shift of all is caught."""
    rng = np.random.default_rng(6)
    mixing = rng.normal(size=(20, 1000))
    x, held_out, new = (rng.normal(size=(200, 20)) @ mixing for _ in range(3))
    conformal = fit_conformal(x, np.arange(200) % 4, held_out)
    assert np.mean(conformal.p_values(new) <= PROMISED_RATE) < 0.12
    assert (conformal.p_values(new + 10.0 * rng.normal(size=1000)) <= PROMISED_RATE).all()


def test_too_few_held_out_samples_promise_nothing():
    """Ten samples cannot tell one window in twenty."""
    rng = np.random.default_rng(5)
    with pytest.raises(ValueError, match="promise"):
        fitted(rng, held_out=10)
