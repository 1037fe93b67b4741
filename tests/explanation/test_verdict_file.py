"""verdict.json: effects at shaft orders, and what a verdict must not list."""

from dataclasses import replace

import numpy as np
import pytest

from made_fits import made_fit
from rippletwin.calibration.frequency_continuation import refine
from rippletwin.calibration.misfit import Score
from rippletwin.explanation.checks.alarms import Alarms
from rippletwin.explanation.checks.bootstrap import NullDistribution
from rippletwin.explanation.checks.cross_validation import Disagreement, Validation
from rippletwin.explanation.checks.support import Support
from rippletwin.explanation.localise.shaft_orders import ShaftEffect, ShaftOrders
from rippletwin.explanation.search.stepwise_search import Search
from rippletwin.explanation.verdict import verdict_file
from rippletwin.explanation.verdict.decision import Decision
from rippletwin.explanation.verdict.explanation import Explanation
from rippletwin.explanation.verdict.mismatch_entry import describe_mismatch
from rippletwin.explanation.verdict.verdict_file import verdict_dict
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.twin import Twin
from synthetic_observations import POINTS, make

FLUCTUATION = ShaftEffect("speed_fluctuation", 4e-3, (3.9e-3, 4.1e-3))
MODULATION = ShaftOrders(0.02, 1e-9, 0.95, (FLUCTUATION,), {"point 1": 4e-3})


@pytest.fixture(scope="module")
def explanation():
    """A line without effects and with a speed fluctuation, explained as consistent."""
    rig, observations, truth = make(np.random.default_rng(3), points=POINTS[:1])
    base = refine(Twin(rig, observations), (), observations, [truth.theta])
    scores = {"in_sample": Score(0.02, 0.01), "held_out": Score(0.02, 0.01)}
    return Explanation(
        rig=rig,
        observations=tuple(observations),
        search=Search(base, [base], base),
        alarms=Alarms(0.004, (0.1, "load"), (0.1, "load"), (0.5, "point 1")),
        validation=Validation(scores, scores, scores, ("recording 1",), 0.0, 0.004),
        decision=Decision("consistent", base),
        shaft_orders=MODULATION,
    )


def decided(explanation, verdict):
    return replace(explanation, decision=replace(explanation.decision, verdict=verdict))


@pytest.mark.parametrize("verdict", ["consistent", "calibration_only"])
def test_a_speed_fluctuation_is_named_with_its_own_interval(explanation, verdict):
    """The amplitude has the interval that was found for it; no posterior probability is stated,
    because no evidence was calculated."""
    result = verdict_dict(decided(explanation, verdict))
    (effect,) = result["effects"]
    assert result["verdict"] == "named" and result["mismatch"]["present"]
    assert result["mismatch"]["where"]["element"] == "source"
    assert effect["name"] == "speed_fluctuation"
    amplitude = {"value": 4e-3, "ci95": [3.9e-3, 4.1e-3], "unit": "rad"}
    assert effect["parameters"]["amplitude"] == amplitude
    assert "probability" not in effect


def test_a_modulation_whose_fit_did_not_converge_is_not_established(explanation):
    """The same fluctuation is supported only: something is missing and has no name, and the
    sentence says why."""
    silent = decided(explanation, "consistent")
    rough = replace(silent, shaft_orders=replace(MODULATION, converged=False))
    for each, support, verdict in (
        (silent, "established", "named"),
        (rough, "supported", "unexplained"),
    ):
        result = verdict_dict(each)
        assert result["verdict"] == verdict and result["mismatch"]["present"]
        assert [effect["support"] for effect in result["effects"]] == [support]
        assert ("did not converge" in result["sentence"]) is (each is rough)


def test_warnings_of_the_case_are_told(explanation):
    """What `check` warns of, as a generic pump, is in the verdict too."""
    warned = replace(explanation, warnings=("pump: only pistons is given",))
    assert verdict_dict(warned)["warnings"] == ["pump: only pistons is given"]


def test_a_disagreement_is_told_with_the_parameters_own_name():
    """Of an effect's support, in SI units; null where nothing could be compared."""
    support = Support("leak", "position", "supported", None, 1.0, 0.0)
    found = Disagreement(6.0, "leak@position.conductance", 1e-11, 2e-11, "recording 1")
    assert verdict_file._disagreement(replace(support, disagreement=found)) == {
        "deviations": 6.0,
        "parameter": "conductance",
        "whole": 1e-11,
        "part": 2e-11,
        "left_out": "recording 1",
    }
    assert verdict_file._disagreement(support) is None


def test_an_unknown_interval_is_left_out(explanation):
    """Without an interval the key is missing: an invented one would be worse."""
    unknown = replace(
        explanation,
        shaft_orders=replace(MODULATION, effects=(replace(FLUCTUATION, interval=None),)),
    )
    (effect,) = verdict_dict(unknown)["effects"]
    assert effect["parameters"]["amplitude"] == {"value": 4e-3, "unit": "rad"}


def test_a_spread_without_a_size_has_no_parameter(explanation):
    """Where no mean flow is known the effect is named, and no number is written."""
    spread = replace(MODULATION, effects=(ShaftEffect("piston_spread", None),))
    (effect,) = verdict_dict(replace(explanation, shaft_orders=spread))["effects"]
    assert effect["name"] == "piston_spread" and effect["parameters"] == {}


@pytest.mark.parametrize(
    ("verdict", "supports"), [("bad_data", []), ("unexplained", ["supported"])]
)
def test_shaft_effects_are_not_established_where_nothing_else_is(explanation, verdict, supports):
    """Contradicting data show no effect. Shaft orders that an incomplete twin interprets establish
    none, and the place of the mismatch is then not the source for their sake."""
    result = verdict_dict(decided(explanation, verdict))
    assert result["verdict"] == verdict
    assert [effect["support"] for effect in result["effects"]] == supports
    assert result["mismatch"]["where"]["element"] != "source"
    is_mentioned = "They indicate a speed fluctuation" in result["sentence"]
    assert is_mentioned is (verdict == "unexplained")


def test_before_is_the_best_that_calibration_without_effects_reaches(explanation):
    """A plain calibration that fits better than the base gives the misfits before, in sample and
    held out. The model error before stays that of the base."""
    plain = {"in_sample": Score(0.015, 0.008), "held_out": Score(0.017, 0.009)}
    validation = replace(explanation.validation, calibrated=plain)
    fit = verdict_dict(replace(explanation, validation=validation))["fit"]
    assert (fit["before"]["in_sample"], fit["before"]["held_out"]) == (0.015, 0.017)
    assert fit["before"]["theil_held_out"] == 0.009
    assert fit["after"]["in_sample"] == 0.02
    assert fit["model_error"]["before"] == explanation.search.base.model_error


HOSE = (EFFECTS["viscoelastic_wall"], Place("segment 1", 0))
VOLUME = (EFFECTS["line_volume"], Place("position"))


def test_places_of_a_rejected_effect_are_not_told_for_a_speed_fluctuation(explanation):
    """The search took a hose in either segment, which the checks rejected: the verdict names the
    speed fluctuation alone, and nothing is equivalent."""
    base, elsewhere = explanation.search.base, (HOSE[0], Place("segment 2", 1))
    hoses = [made_fit(base.evidence + 20.0, hose) for hose in (HOSE, elsewhere)]
    search = replace(explanation.search, best=hoses[0], rivals=hoses)
    result = verdict_dict(replace(decided(explanation, "calibration_only"), search=search))
    assert result["verdict"] == "named" and result["equivalents"] == []
    assert result["next_recording"] is None


def test_the_p_value_bounds_all_hypotheses_that_were_fitted(explanation):
    """Two single effects, a pair found in two orders and a network are four hypotheses, for one of
    which there may be so much evidence. Draws are fitted with single effects, so with them the best
    single effect counts, not the pair."""
    base = explanation.search.base
    single, other, pair, turned, network = (
        made_fit(base.evidence + gain, *hypothesis)
        for gain, hypothesis in (
            (4.0, (HOSE,)),
            (2.0, (VOLUME,)),
            (10.0, (HOSE, VOLUME)),
            (9.0, (VOLUME, HOSE)),
            (3.0, ((EFFECTS["passive_piece"], Place("position")),)),
        )
    )
    search = Search(base, [single, other], pair, [turned, pair], [network])
    e = replace(explanation, search=search, decision=Decision("consistent", pair))
    mismatch = describe_mismatch(e, "consistent", [], [])
    assert mismatch["p_value"] == pytest.approx(4 * np.exp(-10.0))
    drawn = replace(e, null_distribution=NullDistribution((*[1.0] * 8, 5.0, 6.0)))
    assert describe_mismatch(drawn, "consistent", [], [])["p_value"] == pytest.approx(3 / 11)
