"""Scoring of a case: which names, places and intervals count as right."""

from types import SimpleNamespace

import numpy as np
import pytest

from concealed.failures import failure
from concealed.names import assign_claims, is_place_right, judge_names
from concealed.score import ACCEPTABLE_MISFIT, intervals_hold, score_baseline, score_case
from concealed.tool import NO_BASELINES, crash_verdict, pick_by_bic
from rippletwin.twin.effects.base import Place
from scored_cases import claim, effect, pair_truth, score_example, truth, verdict


def test_right_name_place_and_interval():
    """A leak named at its place with an interval that holds the truth is right in all; the same
    elsewhere, with an interval that does not, is right in name only."""
    row = score_example(truth(), verdict("named", claim("leak", conductance=(1.5, 2.5))))
    assert row["right"] and not row["wrong"] and row["places_right"] == [True]
    assert row["intervals_hold"] == [True] and row["probabilities"] == [(0.9, True)]
    assert row["established"] == [True] and row["absorbed"] == pytest.approx(0.8)
    assert failure(row) is None
    elsewhere = claim("leak", position=(4.0, 4.5), conductance=(3, 4))
    row = score_example(truth(), verdict("named", elsewhere))
    assert row["right"] and row["places_right"] == [False] and row["intervals_hold"] == [False]
    assert failure(row) == "wrong place"


def test_misfits_before_and_after_are_those_of_the_verdict():
    """The page states the same calibrated and corrected misfits as verdict.json."""
    said = verdict("named", claim("leak"))
    said["fit"]["before"] = {"in_sample": 0.31, "held_out": 0.32}
    row = score_example(truth(), said)
    assert (row["misfit_calibrated"], row["held_out_calibrated"]) == (0.31, 0.32)
    assert (row["misfit_corrected"], row["held_out_corrected"]) == (0.01, 0.02)


def test_a_wrong_name_and_a_name_beside_a_right_one_are_told_apart():
    """Another effect is wrong; the right one with another beside it is right, and the other is
    wrong."""
    row = score_example(truth(), verdict("named", claim("line_volume")))
    assert not row["right"] and row["wrong"] == "line_volume" and failure(row) == "wrong name"
    both = verdict("named", claim("leak"), claim("unsteady_friction", "line"))
    row = score_example(truth(), both)
    assert row["right"] and row["wrong"] == "unsteady_friction"
    assert row["probabilities"] == [(0.9, True), (0.9, False)]
    assert row["established"] == [True, False]
    assert failure(row) == "wrong name beside a right one"


def test_a_class_that_holds_the_truth_is_right_and_another_is_not():
    """The class is the verdict's `equivalents` or one declared beforehand."""
    said = verdict("ambiguous", claim("line_volume"), equivalents=[("leak", "line_volume")])
    assert score_example(truth(), said)["right"]
    said = verdict("ambiguous", claim("line_volume"), equivalents=[("side_branch", "line_volume")])
    assert not score_example(truth(), said)["right"]
    declared = truth(classes=[["leak", "line_volume"]], kind="indistinguishable")
    assert score_example(declared, verdict("named", claim("line_volume")))["right"]


def test_one_ambiguous_claim_counts_for_one_effect_of_a_pair():
    """A pair lies whole in the class of the only claim: one of two effects is found."""
    said = verdict("ambiguous", claim("leak"), equivalents=[("leak", "side_branch")])
    row = score_example(pair_truth(), said)
    assert row["effects_found"] == 1 and not row["right"]
    assert failure(row) == "1 of 2 effects named"


def test_two_claims_are_assigned_so_that_both_effects_of_a_pair_are_found():
    """A line volume stands for the leak, since the side branch is claimed by its own name; each
    order of the claims gives the same."""
    claims = [claim("line_volume"), claim("side_branch")]
    classes = [("leak", "line_volume", "side_branch")]
    for ordered in (claims, claims[::-1]):
        row = score_example(pair_truth(), verdict("ambiguous", *ordered, equivalents=classes))
        assert row["effects_found"] == 2 and row["right"] and not row["wrong"]


def test_an_effect_named_twice_where_there_is_one_is_wrong_once():
    """A second claim of the same name counts for no true effect; the one at the true element
    counts."""
    row = score_example(truth(), verdict("named", claim("leak", "load", None), claim("leak")))
    assert row["effects_found"] == 1 and row["wrong"] == "leak" and row["places_right"] == [True]
    assert row["probabilities"] == [(0.9, False), (0.9, True)]


def test_assignment_finds_many_effects_before_own_names():
    """Of two true effects A and B with claims A and C, where C can only stand for A, the claim A
    goes to B, which finds both."""
    true = [{"name": name, "element": "line", "position": None} for name in "AB"]
    named = [{"name": name, "element": "line", "parameters": {}} for name in "AC"]
    classes = [{"A", "B"}, {"A", "C"}]
    assert assign_claims(true, named, classes, 5.0) == [named[1], named[0]]
    assert assign_claims(true, named, [], 5.0) == [named[0], None]
    assert assign_claims([], named, [], 5.0) == []
    assert assign_claims(true, [], [], 5.0) == [None, None]


def test_of_alike_effects_the_one_at_the_claimed_place_is_found():
    """Three cavities are there and one is named, at the third one's place: that one is found."""
    volumes = [
        {"name": "line_volume", "element": "position", "position": x, "position_nominal": x}
        for x in (0.3, 3.0, 5.3)
    ]
    named = {
        "name": "line_volume",
        "element": "position",
        "parameters": {"position": {"ci95": [5.2, 5.29]}},
    }
    assert assign_claims(volumes, [named], [], 6.4) == [None, None, named]


def test_no_effect_and_effects_outside_the_library():
    """Without an effect nothing may be established that is not there; outside the library neither.
    Nuisance physics that is there may be."""
    none = truth(kind="none", effects=[], change=0.0)
    assert failure(score_example(none, verdict("consistent"))) is None
    assert failure(score_example(none, verdict("calibration_only"))) is None
    assert failure(score_example(none, verdict("unexplained"))) is None
    named = verdict("named", claim("leak"))
    assert failure(score_example(none, named)) == "false alarm"
    there = none | {"nuisance": [effect("leak")]}
    assert failure(score_example(there, named)) is None
    elsewhere = verdict("named", claim("leak", position=(1.0, 1.2)))
    assert failure(score_example(there, elsewhere)) == "false alarm"
    only_supported = verdict("named", claim("leak") | {"support": "supported"})
    row = score_example(none, only_supported)
    assert failure(row) is None and row["supported_too"]["wrong"] == "leak"
    outside = truth(kind="outside")
    outside["effects"][0]["name"] = "resonator"
    assert failure(score_example(outside, verdict("unexplained"))) is None
    assert failure(score_example(outside, verdict("named", claim("leak")))) == "misnamed"
    assert failure(score_example(outside, verdict("consistent"))) == "not noticed"


def test_line_errors_are_against_the_true_line():
    """10 % of delay at a stated 5 % is two deviations; the impedance is exact."""
    row = score_example(truth(), verdict("consistent"))
    delay, impedance = row["line_errors"]["calibrated"]
    assert delay["relative"] == pytest.approx(0.1) and delay["z"] == pytest.approx(2.0)
    assert impedance["relative"] == 0.0


def test_an_effect_without_a_stated_probability_is_scored():
    """It counts as named, and not among the stated probabilities."""
    shaft = {"name": "piston_spread", "element": "source", "parameters": {}}
    row = score_example(truth(), verdict("named", claim("leak"), shaft))
    assert row["wrong"] == "piston_spread" and row["probabilities"] == [(0.9, True)]


@pytest.mark.parametrize("kind", ["none", "off", "single", "pair", "outside", "indistinguishable"])
def test_a_tool_that_ended_with_an_error_is_a_failure_of_every_kind(kind):
    """It has named nothing and raised no alarm, also where an effect that is not plain may be
    missed. What the tool's process writes then is all that scoring asks for."""
    case = truth(kind=kind, change=0.01)
    row = score_case(case, crash_verdict(ValueError("no")), NO_BASELINES | {"seconds": 1.0})
    assert row["verdict"] == "crashed" and not row["right"] and not row["alarm"]
    assert failure(row) == "crashed"


def test_an_own_name_comes_before_an_equivalent_one():
    """One true effect, two claims that both may stand for it: that of its own name counts, though
    the other is at its place."""
    true = [{"name": "A", "element": "line", "position": None}]
    equivalent = {"name": "B", "element": "line", "parameters": {}}
    own = {"name": "A", "element": "load", "parameters": {}}
    assert assign_claims(true, [equivalent, own], [{"A", "B"}], 5.0) == [own]


def test_a_pick_of_a_simple_method():
    """None raises no alarm; the true effect is right, and so is a name of one class; nuisance
    physics is there; another is an alarm that is wrong."""
    sealed = {
        "effects": [effect("leak")],
        "classes": [["leak", "side_hole"]],
        "nuisance": [effect("unsteady_friction")],
    }
    assert score_baseline(sealed, None) == {"alarm": False, "right": False, "named": ""}
    for name, right, wrong in (
        ("leak", True, ""),
        ("side_hole", True, ""),
        ("unsteady_friction", False, ""),
        ("line_volume", False, "line_volume (position)"),
    ):
        score = score_baseline(sealed, {"name": name, "element": "position"})
        assert score == {"alarm": bool(wrong), "right": right, "named": wrong}


@pytest.mark.parametrize(
    ("criteria", "picked"),
    [((9.0, 5.0, 3.0), "leak"), ((9.0, 2.0, 3.0), None), ((1.0, 2.0, 3.0), None)],
    ids=["a further effect", "the usual one", "none"],
)
def test_the_least_bic_picks_what_is_beside_the_usual_effects(criteria, picked):
    """Of the line alone, with friction, and with friction and a leak: friction is always tried, so
    that it is no pick."""
    friction = SimpleNamespace(name="unsteady_friction", usual=lambda *_: True)
    leak = SimpleNamespace(name="leak", usual=lambda *_: False)
    places = (friction, Place("line")), (leak, Place("position"))
    twin = SimpleNamespace(parameters=[], theta=np.zeros(0))
    base, *fits = (
        SimpleNamespace(twin=twin, objective=value, hypothesis=places[:k])
        for k, value in enumerate(criteria)
    )
    explanation = SimpleNamespace(
        observations=[SimpleNamespace(values=np.zeros(3))],
        rig=None,
        search=SimpleNamespace(base=base, single_effect_fits=fits),
    )
    found = pick_by_bic(explanation)
    assert (found and found["name"]) == picked


def test_nuisance_physics_at_its_place_counts_for_no_concealed_effect():
    """A wall of the whole line creeps as nuisance physics, that of segment 3 more: a claim for the
    line is there, but does not find what is concealed; a claim for the segment does."""
    wall = effect("viscoelastic_wall") | {"position": None}
    sealed = truth(effects=[wall | {"element": "segment 3"}], nuisance=[wall | {"element": "line"}])
    for element, found in (("line", 0), ("segment 3", 1)):
        said = verdict("named", claim("viscoelastic_wall", element, None))
        names = judge_names(sealed, said)
        assert len(names.found) == found and not names.wrong


@pytest.mark.parametrize(
    ("misfit", "alarm"), [(ACCEPTABLE_MISFIT, False), (1.01 * ACCEPTABLE_MISFIT, True)]
)
def test_calibration_alone_raises_the_alarm_by_its_misfit(misfit, alarm):
    """Beyond what is acceptable; it never names an effect."""
    said = verdict("consistent")
    said["fit"]["before"]["in_sample"] = misfit
    row = score_example(truth(), said)
    assert row["baselines"]["recalibrate"]["alarm"] is alarm
    assert not row["baselines"]["recalibrate"]["right"]
    assert row["baselines"]["bic"] == row["baselines"]["sparse"]


def test_what_a_row_takes_from_the_truth():
    """A change counts as plain from 5 % on; calibration absorbs no less than nothing."""
    assert score_example(truth(change=0.05), verdict("consistent"))["plain"]
    assert not score_example(truth(change=0.0499), verdict("consistent"))["plain"]
    said = verdict("consistent")
    said["fit"]["before"]["in_sample"] = 0.6  # nominal 0.5
    row = score_example(truth(), said, log_evidence=7.0)
    assert row["absorbed"] == 0.0 and row["oracle_log_evidence"] == 7.0
    assert not row["alarm"] and row["seconds"] == 1.0
    assert score_example(truth(), verdict("unexplained"))["alarm"]


@pytest.mark.parametrize(
    ("interval", "right"),
    [
        ((2.9, 3.2), True),
        ((3.04, 3.06), True),  # 1 % of 5 m from 3.0, and from 3.1
        ((2.8, 3.0), True),  # the actual place alone
        ((3.1, 3.4), True),  # that of the drawing alone
        ((2.8, 2.94), False),  # 0.06 m below 3.0
        ((3.16, 3.4), False),
        ((3.2, 3.4), False),
        ((2.0, 2.9), False),
    ],
)
def test_a_place_is_right_within_the_tolerance_of_lengths(interval, right):
    """Of a leak at 3 m, 3.1 m on the drawing, in a line of 5 m."""
    assert is_place_right(effect("leak"), claim("leak", position=interval), 5.0) is right


def test_an_interval_of_an_equivalent_name_is_not_compared():
    """Its parameters are others. Parameters without an interval are left out."""
    said = verdict("ambiguous", claim("side_hole", conductance=(0.0, 9.0)),
                   equivalents=[("leak", "side_hole")])  # fmt: skip
    assert score_example(truth(), said)["intervals_hold"] == []
    bare = claim("leak")
    bare["parameters"]["conductance"] = {"value": 2.0}
    assert score_example(truth(), verdict("named", bare))["intervals_hold"] == []
    at_ends = [claim("leak", conductance=ends) for ends in ((2.0, 3.0), (1.0, 2.0))]
    for each in at_ends:
        assert score_example(truth(), verdict("named", each))["intervals_hold"] == [True]


def test_an_interval_at_another_element_is_not_compared():
    """The gain of another sensor is at the wrong place and says nothing of the true value."""
    true = effect("sensor_gain", gain_error=0.1) | {"position": None, "element": "sensor p2"}
    for element, held in (("sensor p2", [True]), ("sensor p1", [])):
        said = claim("sensor_gain", gain_error=(0.05, 0.2)) | {"element": element}
        said["parameters"].pop("position", None)
        assert intervals_hold(true, said) == held


FRICTION = claim("unsteady_friction", "line", None)
TRUE_FRICTION = effect("unsteady_friction") | {"element": "line", "position": None}
GAIN = claim("sensor_gain", "sensor p1", None)


def with_evidence(said, **evidence):
    """The verdict `said`; without an effect of `evidence` so much log evidence is lost."""
    places = {"unsteady_friction": "line", "sensor_gain": "sensor p1", "leak": "position 2"}
    rows = [{"effect": e, "place": places[e], "evidence": x} for e, x in evidence.items()]
    return said | {"without": rows}


@pytest.mark.parametrize(
    ("evidence", "first"),
    [
        ({"unsteady_friction": 90.0, "sensor_gain": 9.0, "leak": 20.0}, True),
        ({"unsteady_friction": 90.0, "sensor_gain": 21.0, "leak": 20.0}, False),
        ({"unsteady_friction": 90.0, "sensor_gain": 21.0, "leak": None}, True),
    ],
)
def test_named_first_is_what_has_most_evidence_beside_nuisance(evidence, first):
    """A leak is concealed. Friction, nuisance that is there, may have more evidence, a gain that is
    not there may not; a leak without which nothing fits has most. It is named in all three."""
    said = with_evidence(verdict("named", FRICTION, GAIN, claim("leak")), **evidence)
    row = score_example(truth(nuisance=[TRUE_FRICTION]), said)
    assert row["right"] and row["named_first"] is first


def test_named_first_may_be_either_effect_of_a_pair():
    """Both are concealed, and one has all the evidence."""
    said = with_evidence(verdict("named", claim("side_branch"), claim("leak")), leak=20.0)
    assert score_example(pair_truth(), said)["named_first"]


def test_named_first_needs_an_established_name():
    """A leak that is supported only is not named, whatever its evidence; an effect at a shaft
    order has none and comes last."""
    supported = with_evidence(
        verdict("named", GAIN, claim("leak") | {"support": "supported"}), leak=20.0, sensor_gain=9.0
    )
    assert not score_example(truth(), supported)["named_first"]
    spread = effect("piston_spread") | {"element": "source", "position": None}
    both = verdict("named", claim("piston_spread", "source", None), GAIN)
    assert not score_example(truth(effects=[spread]), with_evidence(both, sensor_gain=9.0))[
        "named_first"
    ]


def test_supported_effects_count_in_scores_of_their_own():
    """A leak that is supported only counts there and not among the named; a suggested one counts
    nowhere; of a pair one is established and one supported, in an unexplained verdict none."""
    leak, branch = claim("leak"), claim("side_branch") | {"support": "supported"}
    row = score_example(pair_truth(), verdict("named", leak, branch))
    assert row["effects_found"] == 1 and row["established"] == [True]
    assert row["supported_too"] == {
        "there": [True, True], "right": True, "effects_found": 2, "wrong": "",
    }  # fmt: skip
    suggested = claim("leak") | {"support": "suggested"}
    said = verdict("unexplained", suggested, branch)
    row = score_example(truth(), said)
    assert row["named"] == "" and row["established"] == []
    assert row["supported_too"]["there"] == [False]
    assert row["supported_too"]["wrong"] == "side_branch" and not row["supported_too"]["right"]


@pytest.mark.parametrize(
    ("interval", "network", "right"),
    [
        ((2.0, 4.2), None, True),  # middle 3.1, drawn there
        ((2.0, 3.4), None, False),  # middle 2.7: 5 % of 5 m are 0.25
        ((2.0, 4.2), 3.4, False),  # 0.3 from the drawing
        ((0.0, 1.0), 2.8, True),
        (None, None, False),  # of no single element
    ],
)
def test_place_of_a_remainder(interval, network, right):
    """What the library does not have is at 3.0 m, drawn at 3.1 m. A network that stands in says
    where the remainder is, else the middle of its interval."""
    stand_in = network and {"parameters": {"position": {"value": network}}}
    remainder = {"position_m": interval, "stand_in": stand_in}
    hidden = truth(kind="outside", effects=[effect("resonator")])
    row = score_example(hidden, verdict("unexplained") | {"remainder": remainder})
    assert row["remainder_right"] == [right]


def test_a_remainder_counts_only_for_what_the_library_has_not_and_has_a_place():
    """A leak is in the library; a liquid is everywhere; where nothing remains nothing is right."""
    liquid = effect("stiffening_liquid") | {"position": None}
    said = verdict("named") | {"remainder": None}
    assert score_example(truth(), said)["remainder_right"] == []
    assert score_example(truth(kind="outside", effects=[liquid]), said)["remainder_right"] == []
    hidden = truth(kind="outside", effects=[effect("resonator")])
    assert score_example(hidden, said)["remainder_right"] == [False]
