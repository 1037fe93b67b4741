"""The verdict's sentence: what it says for each kind of verdict."""

from types import SimpleNamespace

import pytest

from rippletwin.explanation.localise.shaft_orders import ShaftOrders
from rippletwin.explanation.verdict.number_text import (
    load_sentences,
    parameters_sentence,
    sensor_sentences,
)
from rippletwin.explanation.verdict.summary_text import (
    _ripple_error,
    liquid_like_air,
    summary_text,
)

SPREAD = ShaftOrders(0.02, 1e-9, 0.95, "piston_spread", 0.03, interval=(0.025, 0.036))


def summarise(
    verdict,
    shaft_orders=None,
    raised=(),
    pull=(0.1, "load"),
    pump=None,
    remainder=None,
    gain=0.1,
    **decision,
):
    """The sentence of a verdict without effects in the line; its misfits are 2 %."""
    twin = SimpleNamespace(parameters=(), theta=())
    e = SimpleNamespace(
        shaft_orders=shaft_orders,
        alarms=SimpleNamespace(raised=raised, pull=pull, drift=(1e-9, "recording 1")),
        decision=SimpleNamespace(
            accepted=SimpleNamespace(hypothesis=(), twin=twin),
            supports=(),
            established=(),
            **decision,
        ),
    )
    fit = {"before": {"held_out": 0.02}, "after": {"held_out": 0.02}}
    fit["expected_gain"] = {"after": gain}
    result = {"verdict": verdict, "fit": fit, "next_recording": None, "pump": pump or {}}
    result |= {"load": None, "sensors": {}}
    result["remainder"] = remainder
    return summary_text(e, result, [])


def test_shaft_orders_alone_are_named_without_an_effect_of_the_line():
    """A verdict that names an effect at shaft orders only says that the rest is complete."""
    sentence = summarise("named", SPREAD)
    assert "At the piston orders nothing is missing" in sentence
    assert "2.0% of the ripple and indicate a spread of the pistons of 0.03" in sentence
    assert "95 % interval 0.025 to 0.036" in sentence


def test_an_unexplained_verdict_mentions_the_shaft_orders():
    """They are an observation, which holds though no effect is established."""
    sentence = summarise("unexplained", SPREAD)
    assert "Something is missing, and nothing is established" in sentence
    assert "indicate a spread of the pistons" in sentence


def test_bad_data_say_what_contradicts_what_and_nothing_of_the_pump():
    """Nothing that a fit or the shaft orders of contradicting data indicate is repeated."""
    sentence = summarise("bad_data", SPREAD, contradiction="sensor p3 is dead")
    assert sentence == "The data contradict themselves: sensor p3 is dead."
    drifting = summarise("bad_data", None, ("drift",), contradiction="sensor p3 is dead")
    assert "recording 1 differ: the state drifted" in drifting


@pytest.mark.parametrize(
    ("raised", "is_named"), [((), True), (("pull",), True), (("disagreement",), False)]
)
def test_calibration_only_names_the_value_that_is_off(raised, is_named):
    """The value furthest from the data sheet is named, unless operating points disagree instead."""
    sentence = summarise("calibration_only", raised=raised, pull=(2.9, "diameter[4]"))
    assert "nominal values of the line are outside their stated tolerances" in sentence
    assert ("diameter[4] is 2.9 standard deviations from the data sheet" in sentence) is is_named


def test_a_fit_that_did_not_converge_is_told():
    """A step that promises 5 of log posterior is told, one of 0.1 is not."""
    assert "did not converge: one more step promises 5.0" in summarise("consistent", gain=5.0)
    assert "converge" not in summarise("consistent")


def test_a_parameter_is_in_units_of_a_test_bench():
    """1e-12 m3/(Pa s) is 1e-12 times 60000 L/min and 1e5 bar: 0.006 L/min per bar; no power of ten
    is left to read, and every minus is the keyboard's."""
    conductance = {"value": 1e-12, "ci95": [-1e-12, 3e-12], "unit": "m3/(Pa s)"}
    sentence = parameters_sentence("leak (p1)", {"conductance": conductance})
    said = "Leak (p1): conductance 0.006 L/min per bar (95 % interval -0.006 to 0.018)."
    assert sentence == said


def test_the_pump_is_mentioned_if_it_differs_from_the_data_sheet():
    """Ports that open half a degree late are mentioned; a value within its interval is not."""
    modulus = {"value": 1.21e9, "sheet": 1.25e9, "ci95": [1.15e9, 1.27e9], "unit": "Pa"}
    timing = {"value": 0.5, "sheet": 0.0, "ci95": [0.4, 0.6], "unit": "deg"}
    pump = {"bulk_modulus": modulus, "port_timing": timing}
    assert "of the pump: port timing 0.50° (data sheet 0)." in summarise("consistent", pump=pump)
    timing["ci95"] = [-0.1, 1.1]
    assert "port" not in summarise("consistent", pump=pump)


def test_what_remains_is_told_with_place_and_law():
    """Its size, element, interval and law, and the network that stands in for it."""
    remainder = {
        "misfit": 0.08,
        "model_error": 0.069,
        "element": "segment 1",
        "position_m": [0.12, 0.14],
        "law": "proportional to jw, like a compliance or an inertance",
        "stand_in": {"form": "shunt one-port", "passive": True},
    }
    sentence = summarise("unexplained", remainder=remainder)
    assert "What then remains is 6.9% of the reading" in sentence
    assert "belongs to segment 1 (0.12 to 0.14 m from the pump) and is proportional" in sentence
    assert "A shunt one-port (passive) stands in for it in the twin." in sentence
    nowhere = summarise("unexplained", remainder=remainder | {"element": None})
    assert "no single element accounts for it" in nowhere


@pytest.mark.parametrize(
    ("name", "pressures", "is_warned"),
    [
        ("entrained_air", (9e6,), True),
        ("entrained_air", (9e6, 9.1e6), True),
        ("entrained_air", (9e6, 7e6), False),
        ("entrained_air", (None,), False),
        ("unsteady_friction", (9e6,), False),
    ],
)
def test_air_at_one_pressure_may_be_another_liquid(name, pressures, is_warned):
    """At one pressure a liquid that stiffens by another law fits as well as entrained air.

    The sentence says so there, and nowhere else."""
    warning = liquid_like_air([name, "leak"], pressures)
    assert (len(warning) == 1) is is_warned
    assert all("any liquid that stiffens" in sentence for sentence in warning)


def test_a_wrong_ripple_is_told_apart_from_a_wrong_line():
    """With the nominal ripple a misfit of 40 % beside a model error of 1 % is the ripple's, and
    both misfits are told; one of 2 % is not."""
    fit = {"model_error": {"after": 0.01}, "after": {"in_sample": 0.02}}
    e = SimpleNamespace(observations=[SimpleNamespace(source="nominal")])
    (sentence,) = _ripple_error(e, fit | {"nominal_ripple": {"in_sample": 0.4}})
    assert "misses 40% of the reading" in sentence and "2.0%" in sentence
    assert _ripple_error(e, fit | {"nominal_ripple": {"in_sample": 0.02}}) == []


def test_an_unknown_load_and_uncalibrated_sensors_are_told():
    """At the ends and the middle of the band; a phase of 0.1 rad is 5.7 degrees."""
    load = {
        "frequency_hz": [100.0, 800.0, 1500.0],
        "reflection": {"re": [0.3, 0, 0], "im": [0.4, 0.1, 0]},
    }
    (said,) = load_sentences(load)
    assert "0.50 at 100 Hz, 0.10 at 800 Hz and 0.00 at 1500 Hz" in said
    (said,) = sensor_sentences({"m2": {"gain": {"value": 1.12}, "phase": {"value": 0.1}}})
    assert "m2 1.120 (phase +5.7 deg)" in said
    assert load_sentences(None) == [] and sensor_sentences({}) == []


def test_numbers_have_no_power_of_ten():
    """A resonance is at 3004 Hz, not at 3e+03 Hz; 1.3e9 Pa are 1.3 GPa."""
    pump = {
        "frequency": {"value": 3004.0, "ci95": [2998.0, 3010.0], "sheet": 2500.0, "unit": "Hz"},
        "bulk_modulus": {"value": 1.3e9, "ci95": [1.2e9, 1.4e9], "sheet": 1.7e9, "unit": "Pa"},
    }
    sentence = summarise("consistent", pump=pump)
    assert "frequency 3004 Hz (data sheet 2500)" in sentence
    assert "bulk modulus 1.30 GPa (data sheet 1.70)" in sentence
