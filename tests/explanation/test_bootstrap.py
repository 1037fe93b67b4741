"""What chance gives an effect: draws of the line alone, and the threshold from them."""

import numpy as np
import pytest
from scipy.stats import gumbel_r

from rippletwin.calibration.frequency_continuation import refine
from rippletwin.calibration.posterior import Posterior
from rippletwin.explanation.checks import bootstrap
from rippletwin.explanation.checks.bootstrap import (
    NullDistribution,
    bootstrap_null,
    draw_without_effects,
)
from rippletwin.explanation.search import stepwise_search
from rippletwin.twin.twin import Twin
from synthetic_observations import POINTS, make


@pytest.fixture(scope="module")
def fitted():
    """A line without effects at one operating point, fitted."""
    rig, observations, truth = make(np.random.default_rng(3), points=POINTS[:1])
    base = Twin(rig, observations)
    return refine(base, (), observations, [truth.theta]), observations


def test_draws_scatter_as_the_likelihood_believes(fitted):
    """Invariance: drawn data, whitened by the covariance that they were drawn from, are
    independent and of unit variance; so their mean square is 1 to its sampling error."""
    fit, observations = fitted
    posterior = Posterior(fit.twin, observations)
    prediction = posterior.predict(fit.twin.theta)
    posterior.estimate_errors(prediction, fit.twin.theta)
    metric, rng = posterior._whitening(prediction), np.random.default_rng(0)
    white = np.array(
        [
            metric.apply(posterior._rotate(posterior.draw(prediction, rng) - prediction))
            for _ in range(200)
        ]
    )
    assert np.mean(np.abs(white) ** 2) == pytest.approx(1.0, abs=0.02)
    assert np.max(np.mean(np.abs(white) ** 2, axis=0)) < 1.6
    assert abs(np.mean(white)) < 0.02


def test_draws_are_recordings_of_their_own(fitted):
    """By definition: same orders and covariance, other values, and the same ones for a seed."""
    fit, observations = fitted
    one, same, other = (
        draw_without_effects(fit, observations, np.random.default_rng(k))[0] for k in (1, 1, 2)
    )
    np.testing.assert_array_equal(one.values, same.values)
    np.testing.assert_array_equal(one.covariance, observations[0].covariance)
    apart = np.linalg.norm(one.values - other.values) / np.linalg.norm(one.values)
    assert 0.005 < apart < 0.3


def test_the_threshold_is_what_chance_passes_in_two_of_a_hundred():
    """Truth known: gains from a Gumbel distribution; its 98 % quantile comes back, and a gain that
    no draw reached has the smallest p-value that so many draws can show."""
    few = NullDistribution(tuple(gumbel_r.rvs(-2.0, 1.5, size=30, random_state=1)))
    assert few.threshold == pytest.approx(gumbel_r.ppf(0.98, -2.0, 1.5), abs=1.5)
    assert few.p_value(100.0) == pytest.approx(1 / 31)
    assert few.p_value(-100.0) == 1.0


def test_chance_gives_no_effect_what_an_effect_must_have(fitted, monkeypatch):
    """Statistics: twelve draws of a line that lacks nothing, three effects refitted to each. None
    gets the log evidence that a name needs; fewer than ten draws are refused."""
    fit, observations = fitted
    few = [
        c
        for c in stepwise_search.applicable_candidates(fit.twin.rig, observations)
        if c[0].name in KEPT
    ]
    monkeypatch.setattr(bootstrap, "applicable_candidates", lambda *_: few)
    found = bootstrap_null(fit, observations, 12, processes=1)
    assert len(found.gains) == 12
    assert max(found.gains) < stepwise_search.ACCEPT
    with pytest.raises(ValueError, match="10"):
        bootstrap_null(fit, observations, 9)


KEPT = ("unsteady_friction", "load_volume", "entrained_air")
