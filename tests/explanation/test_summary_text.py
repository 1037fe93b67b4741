"""What a verdict says in words where nothing but shaft orders are amiss."""

from types import SimpleNamespace

import pytest

from rippletwin.explanation.verdict.summary_text import liquid_like_air
from rippletwin.explanation.verdict.summary_text import summary_text as sentence


def test_shaft_orders_alone_need_no_effect_of_the_line():
    """A named effect that acts at shaft orders only: no fit holds it, and the words say so."""
    e = SimpleNamespace(
        shaft_orders=SimpleNamespace(name="piston_spread", level=0.02),
        alarms=SimpleNamespace(raised=(), pull=(0.0, "load")),
        decision=SimpleNamespace(accepted=SimpleNamespace(hypothesis=())),
    )
    e.decision.accepted.twin = SimpleNamespace(parameters=(), theta=())
    misfits = {"before": {"held_out": 0.02}, "after": {"held_out": 0.02}}
    result = {"verdict": "named", "fit": misfits, "next_recording": None, "pump": {}}
    words = sentence(e, result, [])
    assert "pistons' harmonics the twin lacks nothing" in words
    assert "2.0% of the ripple show piston spread" in words


@pytest.mark.parametrize(
    ("ringing", "told"), [((), True), (("pull",), True), (("disagreement",), False)]
)
def test_calibration_only_names_the_value_that_is_off(ringing, told):
    """The value furthest from the data sheet, unless points disagree rather than the sheet."""
    e = SimpleNamespace(
        shaft_orders=None,
        alarms=SimpleNamespace(raised=ringing, pull=(2.9, "diameter[4]")),
        decision=SimpleNamespace(accepted=SimpleNamespace(hypothesis=())),
    )
    e.decision.accepted.twin = SimpleNamespace(parameters=(), theta=())
    misfits = {"before": {"held_out": 0.01}, "after": {"held_out": 0.01}}
    result = {"verdict": "calibration_only", "fit": misfits, "next_recording": None, "pump": {}}
    words = sentence(e, result, [])
    assert words.startswith("The line's nominal values are off")
    assert ("diameter[4] is 2.9 standard deviations from the data sheet" in words) is told


def test_the_pump_is_told_where_it_is_not_the_sheets():
    """Ports late by half a degree are worth a sentence; numbers within their intervals are not."""
    e = SimpleNamespace(
        shaft_orders=None,
        alarms=SimpleNamespace(raised=(), pull=(0.1, "load")),
        decision=SimpleNamespace(accepted=SimpleNamespace(hypothesis=())),
    )
    e.decision.accepted.twin = SimpleNamespace(parameters=(), theta=())
    modulus = {"value": 1.21e9, "sheet": 1.25e9, "ci95": [1.15e9, 1.27e9], "unit": "Pa"}
    timing = {"value": 0.5, "sheet": 0.0, "ci95": [0.4, 0.6], "unit": "deg"}
    result = {
        "verdict": "consistent",
        "fit": {"before": {"held_out": 0.01}, "after": {"held_out": 0.01}},
    }
    result |= {"next_recording": None, "pump": {"bulk_modulus": modulus, "port_timing": timing}}
    assert "its port plate 0.50 deg late" in sentence(e, result, [])
    timing["ci95"] = [-0.1, 1.1]
    assert "port plate" not in sentence(e, result, [])


@pytest.mark.parametrize(
    ("name", "pressures", "told"),
    [
        ("entrained_air", (9e6,), True),
        ("entrained_air", (9e6, 9.1e6), True),
        ("entrained_air", (9e6, 7e6), False),
        ("unsteady_friction", (9e6,), False),
    ],
)
def test_air_at_one_pressure_may_be_another_liquid(name, pressures, told):
    """A liquid that stiffens by another law was called air where one pressure was recorded (sealed
    trials 9 and 15): the words say so there, and nowhere else."""
    (words,) = liquid_like_air([name, "leak"], pressures) or ("",)
    assert ("any liquid that stiffens" in words) is told
