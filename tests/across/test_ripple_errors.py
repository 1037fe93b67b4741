"""The benchmark of how real ripples differ from those of the data sheet."""

import sys

import numpy as np

from paths import ROOT

sys.path.insert(0, str(ROOT / "benchmarks"))
from ripple_errors import minus_log_likelihood, ripple_error


def test_the_likelihood_is_greatest_at_the_parameters_of_the_draws():
    """Errors are drawn from the error model's covariance, by hand: at twice or half of each of its
    sizes the likelihood is less."""
    rng, tau, sigma = np.random.default_rng(1), 0.3, 0.05
    f = np.linspace(0.1, 4.0, 30)
    kernel = 1.0 + (1.0 + np.outer(f, f)) * np.exp(-0.5 * np.subtract.outer(f, f) ** 2)
    root = np.linalg.cholesky(tau**2 * kernel + sigma**2 * np.eye(30))
    pumps = [
        [(1000.0 * f, np.zeros(30), root @ (rng.normal(size=(30, 2)) @ [1.0, 1.0j]) / np.sqrt(2.0))]
        for _ in range(40)
    ]
    true = np.array([np.log(tau), 0.0, 0.0, np.log(sigma)])
    least = minus_log_likelihood(true, pumps)
    for k in (0, 1, 3):
        for factor in (0.5, 2.0):
            other = true.copy()
            other[k] += np.log(factor)
            assert minus_log_likelihood(other, pumps) > least + 10.0


def test_drawn_pumps_make_less_of_the_highest_harmonics_than_their_sheets():
    """Relief grooves spread the backflow over the angle at which they open: of the harmonics above
    2 kHz less is left than of those below 500 Hz, by more than half in the mean of six pumps."""
    falls = []
    for pump in range(6):
        frequency_hz, orders, error = ripple_error(1043, 6, pump)[0]
        assert np.all(np.diff(orders) == orders[0])
        low, high = error.real[frequency_hz < 500.0], error.real[frequency_hz > 2000.0]
        falls.append(np.mean(low) - np.mean(high))
    assert np.mean(falls) > np.log(2.0)
