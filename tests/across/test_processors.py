"""The benchmark of how much the answers depend on the processor."""

import copy
import sys

import pytest

from paths import ROOT

sys.path.insert(0, str(ROOT / "benchmarks"))
from processors import compare

VERDICT = {
    "verdict": "named",
    "equivalents": [],
    "effects": [
        {
            "name": "leak",
            "element": "position",
            "support": "established",
            "parameters": {
                "position": {"value": 2.0, "ci95": [1.0, 3.0], "unit": "m"},
                "pressure_exponent": {"value": 0.5, "unit": "1"},
            },
        }
    ],
}
DIAGNOSIS = {
    "recordings": [
        {"state": "slipper", "severity": {"slipper": {"value": 6e-7, "ci95": [4e-7, 8e-7]}}}
    ]
}


def test_equal_answers_are_equal():
    assert compare([VERDICT], [copy.deepcopy(VERDICT)]) == (True, True, 0.0)


@pytest.mark.parametrize("which", [0, 1])
def test_the_largest_move_is_told_in_half_intervals(which):
    """An effect's parameter that moves by a fifth of a metre, or a leak that moves by 4e-8 m2: both
    are a fifth of half their intervals. A number without an interval is not told."""
    other = copy.deepcopy([VERDICT, DIAGNOSIS])
    if which == 0:
        other[0]["effects"][0]["parameters"]["position"]["value"] += 0.2
    else:
        other[1]["recordings"][0]["severity"]["slipper"]["value"] += 4e-8
    other[0]["effects"][0]["parameters"]["pressure_exponent"]["value"] = 9.0
    equal, agree, moved = compare([VERDICT, DIAGNOSIS], other)
    assert (equal, agree) == (False, True) and moved == pytest.approx(0.2)


@pytest.mark.parametrize("key", ["support", "state"])
def test_other_words_are_another_answer(key):
    """Another support of an effect, another state of a recording."""
    other = copy.deepcopy([VERDICT, DIAGNOSIS])
    holder = other[0]["effects"][0] if key == "support" else other[1]["recordings"][0]
    holder[key] = "suggested" if key == "support" else "healthy"
    assert compare([VERDICT, DIAGNOSIS], other)[1] is False
