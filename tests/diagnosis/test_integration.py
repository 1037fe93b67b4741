"""Integrals over the logarithm of an area.

Independent truth: closed forms of flat densities, and of Gaussian ones between the prior's ends.
"""

import numpy as np
import pytest
from scipy.stats import norm, truncnorm

from rippletwin.diagnosis.integration import explore

LOW, HIGH = np.log(1e-8), np.log(5e-6)


@pytest.mark.parametrize("middle", [-17.0, -15.3, -13.05])
@pytest.mark.parametrize("sd", [0.02, 0.1, 0.5])
def test_a_gaussian_is_integrated_wherever_it_is(middle, sd):
    """A peak forty times narrower than the first nodes are apart is found, and its integral and
    its 95 % interval are right to a few per cent."""
    found = explore(lambda x: -0.5 * ((x - middle) / sd) ** 2, LOW, HIGH)
    truth = truncnorm((LOW - middle) / sd, (HIGH - middle) / sd, middle, sd)
    inside = norm.cdf(HIGH, middle, sd) - norm.cdf(LOW, middle, sd)
    log_integral = np.log(np.sqrt(2 * np.pi) * sd * inside)
    assert found.log_integral == pytest.approx(log_integral, abs=0.02)
    shares = [0.5, 0.025, 0.975]
    np.testing.assert_allclose(np.log(found.interval), truth.ppf(shares), atol=0.1 * sd)


def test_a_flat_density_has_the_prior_as_posterior():
    """Where the data say nothing, the integral is the interval, the median its middle."""
    found = explore(lambda x: 0.0, LOW, HIGH)
    assert found.log_integral == pytest.approx(np.log(HIGH - LOW))
    assert found.quantiles([0.5])[0] == pytest.approx(0.5 * (LOW + HIGH))


def test_large_log_likelihoods_do_not_overflow():
    """Log likelihoods of 1e5 are only a common factor."""
    large, small = (explore(lambda x, y=y: y - 0.5 * (x + 15.0) ** 2, LOW, HIGH) for y in (1e5, 0))
    assert large.log_integral == pytest.approx(1e5 + small.log_integral, abs=1e-9)
    np.testing.assert_allclose(large.interval, small.interval, rtol=1e-6)


@pytest.mark.parametrize("own", [0.01, 0.3])
def test_a_widened_gaussian_has_the_sum_of_both_variances(own):
    """Also one that is much narrower than the error beside it."""
    found = explore(lambda x: -0.5 * ((x + 15.0) / own) ** 2, LOW, HIGH).widen(0.2)
    ends = norm.ppf([0.025, 0.5, 0.975], -15.0, np.hypot(own, 0.2))
    np.testing.assert_allclose(found.quantiles([0.025, 0.5, 0.975]), ends, atol=0.01)
