"""Scoring of a rig: what counts as right, and how suspicion ranks recordings."""

import math

import pytest

from diagnosed_rigs import RUN, said, scored, truth
from diagnosis_trial.score import is_right


@pytest.mark.parametrize(
    ("state", "told", "right"),
    [
        ("healthy", "healthy", True),
        ("healthy", "unlike", False),
        ("slipper", "slipper", True),
        ("slipper", "slipper+cylinder", False),
        ("slipper+cylinder", "slipper+cylinder", True),
        ("valve_plate", "unlike", True),
        ("valve_plate", "healthy", False),
        ("changed_line", "slipper", False),
        ("cylinder", "crashed", False),
    ],
)
def test_an_unknown_fault_is_right_when_it_is_called_unlike(state, told, right):
    """Known states need their name, all others "unlike"."""
    assert is_right(state, told) is right


def test_rows_compare_truth_and_diagnosis():
    """Interval, piston and suspicion of each recording; healthy ones known as such are no rows."""
    true = truth(
        unknown_00=("slipper", 0.08, {"slipper": 3e-8}),
        unknown_01=("healthy", 0.0, None),
        unknown_02=("cavitation", 0.4, None),
        unknown_03=("slipper+cylinder", 0.2, {"slipper": 3e-8, "cylinder": 5e-8}),
    )
    told = [
        said("unknown_00", "slipper", 1e-6, {"slipper": (2e-8, 4e-8)}, piston=3),
        said("unknown_01", "healthy", 0.9),
        said("unknown_02", "unlike", 0.5),
        said("unknown_03", "slipper", 1e-9, {"slipper": (4e-8, 6e-8)}, piston=3),
    ]
    first, second, third, fourth = scored(7, true, told)
    assert (first["rig"], first["label"], first["right"], first["piston_right"]) == (
        7, "unknown_00", True, True,
    )  # fmt: skip
    (severity,) = first["severities"]
    assert severity["low"] < severity["true"] < severity["high"]
    assert first["suspicion"] == pytest.approx(math.log(1e6), rel=1e-6)
    assert second["right"] and second["suspicion"] == pytest.approx(math.log(1 / 9))
    assert (
        third["right"]
        and third["suspicion"] == pytest.approx(math.log(999))
        and third["probability"] is None
    )
    assert not fourth["right"] and fourth["piston_right"] is None
    assert fourth["severities"][0]["true"] < fourth["severities"][0]["low"]


def test_a_crash_is_no_finding():
    """It is wrong for every state, and ranks below every healthy recording."""
    true = truth(unknown_00=("slipper", 0.08, {"slipper": 3e-8}))
    crashed = [{"label": "unknown_00", "state": "crashed"}]
    (row,) = scored(0, true, crashed, RUN | {"misfit": None, "diagnose_s": None})
    assert not row["right"] and row["suspicion"] == -math.inf and row["likeliest"] is None


def test_a_row_says_where_and_when():
    """An answer that was not given has no row; time and misfit are the run's, and rows are in the
    order of the labels."""
    true = truth(
        unknown_01=("slipper", 0.08, {"slipper": 3e-8}), unknown_00=("healthy", 0.0, None),
        unknown_02=("healthy", 0.0, None),
    )  # fmt: skip
    told = [said("unknown_01", "cylinder", 0.2), said("unknown_00", "healthy", 0.9)]
    rows = scored(0, true, told)
    assert [r["label"] for r in rows] == ["unknown_00", "unknown_01"]
    assert {(r["twin_misfit"], r["fit_s"], r["diagnose_s"]) for r in rows} == {(0.2, 30.0, 12.0)}
    assert [r["likeliest"] for r in rows] == ["healthy", "cylinder"]
    assert rows[1]["severities"] == [] and rows[1]["piston_right"] is None
    assert rows[0]["probability"] == 0.9 and rows[1]["weakest"] == 0.04


@pytest.mark.parametrize(("piston", "right"), [(3, True), (4, False), (None, None)])
def test_the_piston_of_a_single_leak(piston, right):
    true = truth(unknown_00=("slipper", 0.08, {"slipper": 3e-8}))
    (row,) = scored(0, true, [said("unknown_00", "slipper", 0.1, piston=piston)])
    assert row["piston_right"] is right


@pytest.mark.parametrize(("p_value", "odds"), [(1e-3, math.log(999)), (0.9999, math.log(1 / 9))])
def test_unlike_raises_the_suspicion_and_never_lowers_it(p_value, odds):
    """The odds of the states are 1 to 9 against healthy; those of the p-value count where they are
    more."""
    true = truth(unknown_00=("cavitation", 0.4, None))
    told = said("unknown_00", "unlike", 0.9)
    told["unlike"]["p_value"] = p_value
    (row,) = scored(0, true, [told])
    assert row["suspicion"] == pytest.approx(odds)


def test_what_is_sure_is_ranked_by_its_log_odds():
    """Two recordings whose probability of being healthy is 0: the log odds tell them apart."""
    leak = "slipper", 0.1, {"slipper": 1e-8}
    true = truth(unknown_00=leak, unknown_01=leak)
    told = [
        said(label, "slipper", 1e-9) | {"probabilities": {"healthy": 0.0, "slipper": 1.0}}
        | {"log_odds": odds}
        for label, odds in (("unknown_00", 900.0), ("unknown_01", 1100.0))
    ]  # fmt: skip
    assert [row["suspicion"] for row in scored(0, true, told)] == [900.0, 1100.0]
