"""verdict.json: effects at shaft orders, and what a verdict must not list."""

from dataclasses import replace

import numpy as np
import pytest

from rippletwin.calibration.frequency_continuation import refine
from rippletwin.calibration.misfit import Score
from rippletwin.explanation.checks.alarms import Alarms
from rippletwin.explanation.checks.cross_validation import Disagreement, Validation
from rippletwin.explanation.checks.support import Support
from rippletwin.explanation.localise.shaft_orders import ShaftEffect, ShaftOrders
from rippletwin.explanation.search.stepwise_search import Search
from rippletwin.explanation.verdict import verdict_file
from rippletwin.explanation.verdict.decision import Decision
from rippletwin.explanation.verdict.explanation import Explanation
from rippletwin.explanation.verdict.verdict_file import verdict_dict
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
