"""The stepwise search: what it accepts, what it rejects, and what it reaches."""

import numpy as np
import pytest

from made_fits import made_fit
from rippletwin.calibration.error_sizes import MIN_MODEL_ERROR
from rippletwin.calibration.misfit import relative_misfit
from rippletwin.explanation.checks.cross_validation import cross_validate
from rippletwin.explanation.fit_jobs import Workers
from rippletwin.explanation.search.stepwise_search import (
    Search,
    _accepted_extension,
    _accepted_pair,
    _search_stepwise,
    resume_search,
    search_effects,
)
from rippletwin.explanation.thresholds import MIN_LOG_BAYES_FACTOR
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.twin import Twin
from synthetic_observations import make

VOLUME = (EFFECTS["line_volume"], Place("position"))
HOSE = (EFFECTS["viscoelastic_wall"], Place("segment 2", 1))
GAIN = (EFFECTS["sensor_gain"], Place("sensor p2", 1))
RADIATION = (EFFECTS["end_radiation"], Place("load"))  # always present


@pytest.fixture
def small_library(monkeypatch):
    """Only a hose, a sensor's gain and a volume can be found."""
    monkeypatch.setattr(
        "rippletwin.explanation.search.stepwise_search.applicable_candidates",
        lambda *_: [HOSE, GAIN, VOLUME],
    )


def test_the_search_accepts_no_effect_if_nothing_is_missing(small_library):
    """In data without an effect, no effect adds as much evidence as the threshold."""
    bench, observations, _ = make(np.random.default_rng(5))
    search = search_effects(Workers(Twin(bench, observations), observations))
    assert search.best.hypothesis == ()
    assert search.base.model_error < 2 * MIN_MODEL_ERROR
    assert search.log_bayes_factor(search.single_effect_fits[0]) < MIN_LOG_BAYES_FACTOR


@pytest.mark.long
def test_two_volumes_are_found_at_their_places(small_library):
    """Of two volumes in a line both are named, each within 10 cm of where it is and 20 % of its
    size; one volume alone is rejected for the two."""
    two = (VOLUME, (VOLUME[0], Place("position", number=2)))
    values = {
        "line_volume@position.position": 1.7,
        "line_volume@position.volume": 6e-5,
        "line_volume@position 2.position": 5.2,
        "line_volume@position 2.volume": 9e-5,
    }
    bench, observations, _ = make(np.random.default_rng(8), two, values)
    search = search_effects(Workers(Twin(bench, observations), observations))
    assert search.best.names == ("line_volume", "line_volume")
    found = search.best.twin.values()
    at = sorted(
        (found[f"line_volume@{p}.position"], found[f"line_volume@{p}.volume"])
        for _, p in search.best.hypothesis
    )
    np.testing.assert_allclose([x for x, _ in at], [1.7, 5.2], atol=0.1)
    np.testing.assert_allclose([v for _, v in at], [6e-5, 9e-5], rtol=0.2)


def test_the_search_names_the_effect_and_it_holds_on_held_out_points(small_library):
    """A sensor's gain is discriminated from a hose and a volume, and transfers to unseen points.

    There the misfit is within 1.25 of what the true parameters leave. A search that is resumed on
    the same data ends at the same explanation."""
    values = {"sensor_gain@sensor p2.gain_error": 0.08}
    bench, observations, truth = make(np.random.default_rng(6), (GAIN,), values)
    workers = Workers(Twin(bench, observations), observations)
    search = search_effects(workers)
    assert search.best.names == ("sensor_gain",)
    validation = cross_validate(workers, search.base, search.best)
    measured = np.concatenate([o.values for o in observations], axis=1)
    true_misfit = relative_misfit(measured, np.concatenate(truth.predict(observations), axis=1))
    assert validation.after["held_out"].misfit < 1.25 * true_misfit
    assert validation.before["held_out"].misfit > 1.25 * true_misfit
    resumed = resume_search(workers, search)
    assert resumed.best.names == ("sensor_gain",)
    assert resumed.best.evidence == pytest.approx(search.best.evidence, abs=0.5)
    assert resumed.log_bayes_factor(resumed.best) == pytest.approx(
        search.log_bayes_factor(search.best), abs=0.5
    )


def test_the_search_ends_where_what_is_added_is_dropped_again(monkeypatch):
    """Each effect that is added makes the other needless, so that the search could go from one to
    the other for ever: it visits no hypothesis twice, and ends at the better one."""
    module = "rippletwin.explanation.search.stepwise_search"

    hose, gain = made_fit(100.0, HOSE), made_fit(101.0, GAIN)
    revised = {(HOSE, GAIN): gain, (GAIN, HOSE): hose}
    rounds = []

    def extend(workers, best, candidates, progress):
        rounds.append(best.label)
        assert len(rounds) < 10
        other = HOSE if best is gain else GAIN
        return [made_fit(best.evidence + 20.0, *best.hypothesis, other)]

    monkeypatch.setattr(f"{module}.fit_extensions", extend)
    monkeypatch.setattr(f"{module}._revise", lambda workers, best, _: revised[best.hypothesis])
    monkeypatch.setattr(f"{module}.exchange_effects", lambda workers, best, _: best)
    monkeypatch.setattr(f"{module}.move_to_best_position", lambda workers, best: (best, []))
    monkeypatch.setattr(f"{module}.fit_substitutes", lambda *_: [])
    found = _search_stepwise(None, Search(made_fit(0.0), [], hose), [], None)
    assert found.best is gain
    assert rounds == [hose.label, gain.label]


def test_two_effects_that_help_only_together_are_accepted(monkeypatch):
    """Neither adds what a name needs; the two together add what both need, or are left out. Where
    revising drops an effect of before, one more effect needs what one does. A line that fits well
    is not searched for pairs."""
    module = "rippletwin.explanation.search.stepwise_search"
    best = made_fit(100.0, VOLUME, model_error=0.08)

    def search(evidence, revised=(VOLUME, HOSE, GAIN), fit=best):
        pair = made_fit(evidence, VOLUME, HOSE, GAIN)
        after = made_fit(evidence, *revised)
        monkeypatch.setattr(f"{module}.fit_best_pairs", lambda *_: [pair])
        monkeypatch.setattr(f"{module}._revise", lambda *_: after)
        return _accepted_pair(None, fit, []) is after

    enough = 100.0 + 2.0 * MIN_LOG_BAYES_FACTOR
    assert search(enough + 1.0)
    assert not search(enough - 1.0)
    assert search(101.0 + MIN_LOG_BAYES_FACTOR, (HOSE, GAIN))
    assert not search(99.0 + MIN_LOG_BAYES_FACTOR, (HOSE, GAIN))
    assert not search(enough + 1.0, fit=made_fit(100.0, VOLUME))


def test_an_always_present_effect_needs_less_beside_another_effect_only():
    """Alone it needs as much as any other. Beside a hose it is accepted unless the data are 20 to 1
    against it, also where another effect adds more and not enough."""
    alone, hose, gain = made_fit(0.0), made_fit(100.0, HOSE), made_fit(105.0, HOSE, GAIN)
    for evidence, accepted in ((MIN_LOG_BAYES_FACTOR - 1.0, False), (MIN_LOG_BAYES_FACTOR, True)):
        radiation = made_fit(evidence, RADIATION)
        assert _accepted_extension(alone, [radiation]) is (radiation if accepted else None)
    for evidence, accepted in ((98.0, True), (96.0, False)):
        radiation = made_fit(evidence, HOSE, RADIATION)
        assert _accepted_extension(hose, [gain, radiation]) is (radiation if accepted else None)
    enough = made_fit(100.0 + MIN_LOG_BAYES_FACTOR, HOSE, GAIN)
    assert _accepted_extension(hose, [enough, made_fit(99.0, HOSE, RADIATION)]) is enough
    assert _accepted_extension(hose, []) is None
