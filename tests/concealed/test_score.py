"""Scoring of a case: which names, places and intervals count as right."""

import pytest

from concealed.failures import failure
from concealed.score import assign_claims, score_case
from concealed.tool import NO_BASELINES, crash_verdict
from scored_cases import claim, effect, pair_truth, score_example, truth, verdict


def test_right_name_place_and_interval():
    """A leak named at its place with an interval that holds the truth is right in all; the same
    elsewhere, with an interval that does not, is right in name only."""
    row = score_example(truth(), verdict("named", claim("leak", conductance=(1.5, 2.5))))
    assert row["right"] and not row["wrong"] and row["places_right"] == [True]
    assert row["intervals_hold"] == [True] and row["probabilities"] == [(0.9, True)]
    assert row["log_evidence"] == [20.0] and row["absorbed"] == pytest.approx(0.8)
    assert row["where_right"] and failure(row) is None
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
    assert failure(score_example(none, only_supported)) is None
    outside = truth(kind="outside")
    outside["effects"][0]["name"] = "accumulator"
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


def test_a_tool_that_ended_with_an_error_is_scored():
    """It has named nothing and raised the alarm, and is a failure. What the tool's process writes
    then is all that scoring asks for."""
    row = score_case(truth(), crash_verdict(ValueError("no")), NO_BASELINES | {"seconds": 1.0})
    assert row["verdict"] == "crashed" and not row["right"] and row["alarm"]
    assert failure(row) == "not named"
