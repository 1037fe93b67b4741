"""From fits to a verdict, and which of two explanations that contain each other is taken."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rippletwin.calibration import misfit
from rippletwin.calibration.fit import Fit
from rippletwin.calibration.misfit import Score
from rippletwin.explanation import fit_jobs
from rippletwin.explanation.checks import cross_validation
from rippletwin.explanation.checks.alarms import PULL_ALARM, Alarms
from rippletwin.explanation.checks.cross_validation import Validation
from rippletwin.explanation.localise.source_free_fits import compare_evidence
from rippletwin.explanation.search.single_effects import fit_single_effects
from rippletwin.explanation.search.stepwise_moves import (
    fit_extensions,
    fit_substitutes,
    simplify_effects,
)
from rippletwin.explanation.search.stepwise_search import Search
from rippletwin.explanation.thresholds import ACCEPT
from rippletwin.explanation.verdict.decision import (
    MAX_MODEL_ERROR_TO_NAME,
    SURE,
    decide,
    equivalent_effects,
    equivalent_places,
)
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.priors import lognormal
from synthetic_observations import rig

LOUD = Alarms(0.03, (1.0, "diameter[1]"), (1.0, "length[1]"), (1.0, ""))
QUIET = Alarms(0.004, (1.0, "diameter[1]"), (1.0, "length[1]"), (1.0, ""))
FRICTION = replace(EFFECTS["unsteady_friction"], certain=True)
HOSE = (EFFECTS["viscoelastic_wall"], Place("segment 1", 0))
VOLUME = (EFFECTS["line_volume"], Place("position"))
END = (EFFECTS["load_volume"], Place("load"))
SMALL = (EFFECTS["source_impedance"], Place("source", form="volume"))
LARGE = (EFFECTS["source_impedance"], Place("source", form="volume and passage"))


def fit(evidence, *hypothesis, floor=0.004, at=0.0):
    """`at` is the coordinate of the one parameter of its own."""
    own = SimpleNamespace(name="viscoelastic_wall@segment 1.time", prior=lognormal(1e-3, 1.0))
    twin = SimpleNamespace(parameters=(own,), theta=(at,))
    return Fit(hypothesis, twin, 0.0, evidence, None, floor, 0.01, 0.01)


def validation(after, disagreement=1.0, in_sample=0.01):
    """Of 2 % both in sample and held out, `in_sample` and `after` are left."""
    scores = [
        {"held_out": Score(m, 0.5 * m), "in_sample": Score(n, 0.5 * n)}
        for m, n in ((0.02, 0.02), (after, in_sample))
    ]
    return Validation(*scores, ("recording 1",), disagreement)


@pytest.mark.parametrize(
    ("gain", "after", "apart", "alarms", "verdict"),
    [
        (SURE - 1, 0.01, 1.0, QUIET, "named"),
        (SURE - 1, 0.03, 1.0, QUIET, "consistent"),  # fits without, data left out are against it
        (SURE + 1, 0.03, 1.0, QUIET, "consistent"),  # the same, however much it is worth in sample
        (SURE + 1, 0.015, 9.0, QUIET, "unexplained"),  # too much for chance, and folds disagree
        (SURE + 1, 0.03, 1.0, LOUD, "unexplained"),  # the line alone does not fit either
    ],
)
def test_an_explanation_must_hold_where_it_was_not_fitted(gain, after, apart, alarms, verdict):
    base, best = fit(0.0), fit(gain, HOSE)
    found = decide(Search(base, [best], best), alarms, validation(after, apart))
    assert found.verdict == verdict
    assert found.accepted is (base if verdict == "consistent" else best)


@pytest.mark.parametrize(
    ("in_sample", "after", "alarms", "verdict"),
    [
        (0.021, 0.03, QUIET, "calibration_only"),
        (0.019, 0.03, QUIET, "consistent"),  # it fits something, but nothing unseen
        (0.021, 0.03, LOUD, "unexplained"),  # the line alone does not fit either
    ],
)
def test_an_explanation_that_fits_nothing_better_speaks_of_the_sheet(
    in_sample, after, alarms, verdict
):
    """Evidence above SURE that comes from the priors alone: the nominal values are off."""
    base, best = fit(0.0), fit(SURE + 10, HOSE)
    found = decide(Search(base, [best], best), alarms, validation(after, in_sample=in_sample))
    assert found.verdict == verdict
    assert found.accepted is (best if verdict == "unexplained" else base)


@pytest.mark.parametrize(
    ("floor", "at", "verdict"),
    [
        (0.9 * MAX_MODEL_ERROR_TO_NAME, 0.9 * PULL_ALARM, "named"),
        (
            1.1 * MAX_MODEL_ERROR_TO_NAME,
            0.0,
            "unexplained",
        ),  # what is left is neither the pump nor a sensor
        (0.004, 1.1 * PULL_ALARM, "unexplained"),  # no hose is like that
    ],
)
def test_what_only_comes_nearest_has_no_name(floor, at, verdict):
    """However much evidence: what looks alike leaves more than the true effect would, or asks for
    parameters that it never has. It is modelled all the same."""
    base, best = fit(0.0), fit(1000.0, HOSE, floor=floor, at=at)
    found = decide(Search(base, [best], best), LOUD, validation(0.001, in_sample=0.001))
    assert found.verdict == verdict and found.accepted is best


def test_every_effect_is_compared_with_its_relatives():
    """Of hose and delay the delay was taken in first: the other effects of its sensor, and a delay
    of the other sensor, are fitted beside the hose; they do as well, and are a class of names and
    one of places. Of one effect alone nothing is asked: every other has been tried."""
    delay, dynamics = (
        (EFFECTS[n], Place("sensor p1", 0)) for n in ("sensor_delay", "sensor_dynamics")
    )
    elsewhere = (EFFECTS["sensor_delay"], Place("sensor p2", 1))
    other = (EFFECTS["sensor_gain"], Place("sensor p2", 1))
    best, asked = fit(100.0, delay, HOSE), []

    def answer(jobs):
        asked.extend(job["hypothesis"] for job in jobs)
        return [fit(98.0, *job["hypothesis"]) for job in jobs]

    pool = SimpleNamespace(fit=answer)
    found = fit_substitutes(pool, best, [HOSE, delay, dynamics, elsewhere, other, VOLUME])
    assert asked == [(HOSE, dynamics), (HOSE, elsewhere)]
    assert fit_substitutes(pool, fit(100.0, delay), [delay, dynamics]) == []
    search = Search(fit(0.0), [], best, found)
    assert equivalent_effects(search) == (("sensor_delay", "sensor_dynamics"),)
    assert equivalent_places(search) == (
        ("sensor_delay at sensor p1", "sensor_delay at sensor p2"),
    )


@pytest.mark.parametrize(("large", "small"), [(LARGE, [SMALL]), (VOLUME, [END, SMALL])])
@pytest.mark.parametrize("cost", [ACCEPT - 1, ACCEPT + 1])
def test_the_larger_of_two_must_be_worth_its_physics(large, small, cost):
    """A passage beside a volume at the pump, a place of its own for a volume, which may as well be
    at either end of the line: kept if they bring ACCEPT."""
    best = fit(100.0, HOSE, large)
    asked = []

    def answer(jobs):
        asked.extend(jobs)
        return [fit(100.0 - cost, *job["hypothesis"]) for job in jobs]

    pool = SimpleNamespace(base=SimpleNamespace(rig=rig()), fit=answer)
    taken = simplify_effects(pool, best, [HOSE, VOLUME, END, SMALL, LARGE])
    assert [job["hypothesis"] for job in asked] == [(HOSE, each) for each in small]
    assert taken.hypothesis == ((HOSE, small[0]) if cost < ACCEPT else (HOSE, large))


@pytest.mark.parametrize(("floor", "asked"), [(0.004, False), (0.3, True)])
def test_where_no_effect_fits_every_one_is_begun_about_what_is_there(monkeypatch, floor, asked):
    """Fits from nominal values that leave `floor`: only where that is much are effects begun about
    the line as it is without them, and beside the first about the fit with it."""
    monkeypatch.setattr(
        "rippletwin.explanation.search.single_effects.transfer_theta", lambda *_: None
    )
    begun = []

    def answer(jobs, tell=None):
        about = [job["hypothesis"] for job in jobs if "fit" in job]
        begun.extend(about)
        return [
            fit(50.0 if "fit" in job else 10.0, *job["hypothesis"], floor=0.004 if about else floor)
            if job["hypothesis"]
            else fit(0.0, floor=0.3)
            for job in jobs
        ]

    pool = SimpleNamespace(
        base=SimpleNamespace(rig=rig()), fit=answer, observations=("point 1", "point 2")
    )
    base, singles = fit_single_effects(pool, [HOSE, VOLUME])
    assert base.evidence == 0.0
    assert begun == ([(HOSE,), (VOLUME,)] if asked else [])
    assert [f.evidence for f in singles] == ([50.0, 50.0] if asked else [10.0, 10.0])
    monkeypatch.setattr(
        "rippletwin.explanation.search.stepwise_moves.restart_job",
        lambda best, h, rig: {"hypothesis": h},
    )
    begun.clear()
    step = fit_extensions(pool, fit(10.0, HOSE, floor=0.3), [HOSE, VOLUME], None)
    assert begun == ([(HOSE, VOLUME)] if asked else [])
    assert step[0].evidence == (50.0 if asked else 10.0)


def test_effects_that_do_not_transfer_are_dropped_weakest_first(monkeypatch):
    """Of hose, gain and friction the gain costs least and does not help on data left out: it goes.
    Then the hose is tried, which helps, and friction, which no line is without, never. What is
    worth twice what a name needs is not asked."""
    gain, friction = (EFFECTS["sensor_gain"], Place("sensor p1", 0)), (FRICTION, Place("line"))
    costs, tried = {HOSE: 12.0, gain: 9.0, friction: 1.0}, []

    def answer(jobs):
        return [fit(-sum(c for e, c in costs.items() if e not in j["hypothesis"]), *j["hypothesis"])
                for j in jobs]  # fmt: skip

    def validated(pool, without, best, late):
        (lost,) = set(best.hypothesis) - set(without.hypothesis)
        tried.append(lost)
        return validation(0.03 if lost is gain else 0.01)

    monkeypatch.setattr(cross_validation, "cross_validate", validated)
    monkeypatch.setattr(fit_jobs, "transfer_theta", lambda *_: None)
    pool = SimpleNamespace(base=None, fit=answer)
    best = cross_validation.prune_by_cross_validation(pool, fit(0.0, HOSE, gain, friction))
    assert best.hypothesis == (HOSE, friction) and tried == [gain, HOSE]
    costs[HOSE] = costs[gain] = 50.0
    assert (
        len(cross_validation.prune_by_cross_validation(pool, fit(0.0, HOSE, gain)).hypothesis) == 2
    )
    assert tried == [gain, HOSE]


@pytest.mark.parametrize(
    ("after", "disagreement", "holds"),
    [(0.09, 0.0, True), (0.09, 9.0, False), (0.03, 9.0, True), (0.11, 0.0, False)],
)
def test_what_removes_most_of_the_unseen_misfit_may_have_folds_that_disagree(
    after, disagreement, holds
):
    """By definition: of 10 % on data left out 9 % left and folds that agree hold, folds 9 standard
    deviations apart do not, unless two thirds of the misfit are gone; more misfit never holds."""
    scores = [{"held_out": misfit.Score(x, 0.0)} for x in (0.10, after)]
    assert cross_validation.Validation(*scores, (), disagreement).passes is holds


def test_what_is_not_finite_is_not_told():
    """An effect with which no steady state is found where the fit is blind to the source has no
    evidence there: it is left out of what JSON could not hold, another stays."""
    search = Search(fit(0.0), [fit(9.0, HOSE), fit(5.0, VOLUME)], fit(9.0, HOSE))
    blind = [fit(0.0), fit(-np.inf, HOSE), fit(3.0, VOLUME)]
    (told,) = compare_evidence(search, blind)
    assert told["informed"] == 5.0 and told["source_free"] == 3.0
