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
    assert not row["right"] and row["suspicion"] == -math.inf
