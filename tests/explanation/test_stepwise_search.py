"""The stepwise search on cases with and without an effect."""

import numpy as np
import pytest

from rippletwin.calibration.misfit import relative_misfit
from rippletwin.calibration.posterior import MIN_MODEL_ERROR
from rippletwin.explanation.checks.cross_validation import cross_validate
from rippletwin.explanation.fit_jobs import Workers
from rippletwin.explanation.search.stepwise_search import resume_search, search_effects
from rippletwin.explanation.thresholds import ACCEPT
from rippletwin.twin.twin import Twin
from synthetic_effects import GAIN, HOSE, TRUTH, VOLUME
from synthetic_observations import make


@pytest.fixture
def three_candidates(monkeypatch):
    """Only a hose, a sensor's gain and a volume are searched for."""
    monkeypatch.setattr(
        "rippletwin.explanation.search.stepwise_search.applicable_candidates",
        lambda *_: [*HOSE, *GAIN, *VOLUME],
    )


def test_search_accepts_nothing_where_nothing_is_missing(three_candidates):
    """On data of a line without effects no candidate reaches the threshold."""
    bench, observations, _ = make(np.random.default_rng(5))
    search = search_effects(Workers(Twin(bench, observations), observations))
    assert search.best.hypothesis == ()
    assert search.base.model_error < 2 * MIN_MODEL_ERROR
    assert search.gain(search.singles[0]) < ACCEPT


def test_search_names_the_effect_and_it_transfers_to_unseen_points(three_candidates):
    """The search distinguishes a sensor's gain from a hose and a volume. On unseen operating points
    the misfit is within 1.25 of what the true parameters leave, noise and the source's error. A
    search resumed on the same data ends at the same effect."""
    bench, observations, truth = make(np.random.default_rng(6), GAIN, TRUTH)
    pool = Workers(Twin(bench, observations), observations)
    search = search_effects(pool)
    assert search.best.names == ("sensor_gain",)
    checked = cross_validate(pool, search.base, search.best)
    assert checked.passes
    measured = np.concatenate([o.values for o in observations], axis=1)
    least = relative_misfit(measured, np.concatenate(truth.predict(observations), axis=1))
    assert checked.after["held_out"].misfit < 1.25 * least < checked.before["held_out"].misfit
    resumed = resume_search(pool, search)
    assert resumed.best.names == ("sensor_gain",)
    assert resumed.best.evidence == pytest.approx(search.best.evidence, abs=0.5)
    assert resumed.gain(resumed.best) == pytest.approx(search.gain(search.best), abs=0.5)
