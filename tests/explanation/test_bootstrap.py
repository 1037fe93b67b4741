"""The null distribution of the evidence: draws without an effect, and their threshold."""

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
from rippletwin.explanation.explain import explain, explain_observations
from rippletwin.explanation.search import stepwise_search
from rippletwin.explanation.thresholds import MIN_LOG_BAYES_FACTOR
from rippletwin.twin.twin import Twin
from synthetic_observations import POINTS, make


@pytest.fixture(scope="module")
def fitted():
    """A line without effects at one operating point, fitted."""
    rig, observations, truth = make(np.random.default_rng(3), points=POINTS[:1])
    base = Twin(rig, observations)
    return refine(base, (), observations, [truth.theta]), observations


def test_draws_have_the_covariance_of_the_error_model(fitted):
    """Drawn data, whitened by the covariance that they were drawn from, are independent and of unit
    variance: their mean square is 1 to its sampling error."""
    fit, observations = fitted
    posterior = Posterior(fit.twin, observations)
    prediction = posterior.predict(fit.twin.theta)
    posterior.estimate_errors(prediction, fit.twin.theta)
    metric, rng = Posterior(fit.twin, observations), np.random.default_rng(0)
    for name in ("sizes", "products"):
        setattr(metric._errors, name, getattr(posterior._errors, name))
    drawn = np.array([posterior.draw(prediction, rng) for _ in range(200)])
    # The covariance is that of the first prediction: whitened differences from it.
    residuals = metric.whitened(np.concatenate([prediction[None], drawn]))[0]
    white = residuals[0] - residuals[1:]
    assert np.mean(np.abs(white) ** 2) == pytest.approx(1.0, abs=0.02)
    assert np.max(np.mean(np.abs(white) ** 2, axis=0)) < 1.6
    assert abs(np.mean(white)) < 0.02


def test_draws_differ_in_their_values_only(fitted):
    """Two draws have the same orders and covariance and other values; a seed repeats its draw."""
    fit, observations = fitted
    one, same, other = (
        draw_without_effects(fit, observations, np.random.default_rng(k))[0] for k in (1, 1, 2)
    )
    np.testing.assert_array_equal(one.values, same.values)
    np.testing.assert_array_equal(one.covariance, observations[0].covariance)
    apart = np.linalg.norm(one.values - other.values) / np.linalg.norm(one.values)
    assert 0.005 < apart < 0.3


def test_the_threshold_is_exceeded_in_two_of_a_hundred_cases():
    """Of values from a known Gumbel distribution the 98 % quantile comes back. A value above all
    draws has the smallest p-value that so many draws can show."""
    few = NullDistribution(tuple(gumbel_r.rvs(-2.0, 1.5, size=30, random_state=1)))
    assert few.threshold == pytest.approx(gumbel_r.ppf(0.98, -2.0, 1.5), abs=1.5)
    assert few.p_value(100.0) == pytest.approx(1 / 31)
    assert few.p_value(-100.0) == 1.0


@pytest.mark.long
def test_no_draw_without_an_effect_reaches_the_threshold(fitted, monkeypatch):
    """In twelve draws without an effect, with three effects refitted to each, none adds the log
    evidence that a name needs. Fewer than ten draws are refused."""
    fit, observations = fitted
    few = [
        c
        for c in stepwise_search.applicable_candidates(fit.twin.rig, observations)
        if c[0].name in KEPT
    ]
    monkeypatch.setattr(bootstrap, "applicable_candidates", lambda *_: few)
    found = bootstrap_null(fit, observations, 12, processes=1)
    assert len(found.log_bayes_factors) == 12
    assert max(found.log_bayes_factors) < MIN_LOG_BAYES_FACTOR
    with pytest.raises(ValueError, match="10"):
        bootstrap_null(fit, observations, 9)


def test_too_few_draws_are_refused_before_anything_is_fitted():
    """Neither a case nor observations are looked at, which here are none."""
    for explained in (
        lambda: explain(None, draws=9),
        lambda: explain_observations(None, (), draws=9),
    ):
        with pytest.raises(ValueError, match="9 draws are too few"):
            explained()


KEPT = ("unsteady_friction", "load_volume", "source_impedance")
