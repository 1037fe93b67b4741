"""The verdict's sentence: what it says for each kind of verdict."""

import re
from dataclasses import replace
from types import SimpleNamespace

import pytest

from paper_rig import paper_rig
from rippletwin.explanation.checks.cross_validation import Disagreement
from rippletwin.explanation.checks.support import Support
from rippletwin.explanation.localise.shaft_orders import ShaftEffect, ShaftOrders
from rippletwin.explanation.verdict.number_text import (
    load_sentences,
    parameters_sentence,
    sensor_sentences,
)
from rippletwin.explanation.verdict.pressure_text import pressure_sentences
from rippletwin.explanation.verdict.remainder_text import ripple_sentences
from rippletwin.explanation.verdict.summary_text import describe_verdict
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS

SPREAD = ShaftOrders(0.02, 1e-9, 0.95, (ShaftEffect("piston_spread", 0.03, (0.025, 0.036)),))


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
    sheet = SimpleNamespace(tolerance_scale=1.0)
    twin = SimpleNamespace(parameters=(), theta=(), effects=(), rig=sheet)
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
    result |= {"load": None, "sensors": {}, "equivalents": []}
    result["remainder"] = remainder
    return describe_verdict(e, result, [])


def test_shaft_orders_alone_are_named_without_an_effect_of_the_line():
    """A verdict that names an effect at shaft orders only says that the rest is complete."""
    sentence = summarise("named", SPREAD)
    assert "At the piston orders nothing is missing" in sentence
    assert (
        "2.0 % of the ripple. They indicate unequal pistons, by 3.0 % of the mean flow" in sentence
    )
    assert "95 % interval 2.5 to 3.6" in sentence


def test_an_unexplained_verdict_mentions_the_shaft_orders():
    """They are an observation, which holds though no effect is established."""
    sentence = summarise("unexplained", SPREAD)
    assert "Something is missing, and nothing is established" in sentence
    assert "indicate unequal pistons" in sentence


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
    assert ("diameter of segment 4: it is 2.9 standard deviations from" in sentence) is is_named


def test_a_fit_that_did_not_converge_is_told():
    """A step that promises 5 of log posterior is told, one of 0.1 is not."""
    assert "did not converge: one more step promises 5.0" in summarise("consistent", gain=5.0)
    assert "converge" not in summarise("consistent")


def test_a_parameter_is_in_units_of_a_test_bench():
    """1e-12 m3/(Pa s) is 1e-12 times 60000 L/min and 1e5 bar: 0.006 L/min per bar; no power of ten
    is left to read, and every minus is the keyboard's."""
    conductance = {"value": 1e-12, "ci95": [-1e-12, 3e-12], "unit": "m3/(Pa s)"}
    sentence = parameters_sentence("leak in segment 1", {"conductance": conductance})
    said = "Leak in segment 1: leakage conductance 0.006 L/min per bar (-0.006 to 0.018)."
    assert sentence == said


def test_a_parameter_that_the_effect_names_already_is_not_repeated():
    """A delay is a delay; -4 us are -4 us and not -0.004 ms."""
    delay = {"value": -4e-6, "ci95": [-4.2e-6, -3.8e-6], "unit": "s"}
    sentence = parameters_sentence("delay of sensor p1", {"delay": delay})
    assert sentence == "Delay of sensor p1: -4.00 µs (-4.20 to -3.80)."


def test_the_pump_is_mentioned_if_it_differs_from_the_data_sheet():
    """Ports that open half a degree late are mentioned, with what the number takes for granted; a
    value within its interval is not."""
    modulus = {"value": 1.21e9, "sheet": 1.25e9, "ci95": [1.15e9, 1.27e9], "unit": "Pa"}
    timing = {"value": 0.5, "sheet": 0.0, "ci95": [0.4, 0.6], "unit": "deg"}
    pump = {"bulk_modulus": modulus, "port_timing": timing}
    said = summarise("consistent", pump=pump)
    assert "the data sheet's: lag of the port timing 0.50° (data sheet 0°)." in said
    assert "only if its ports open as those of the model" in said
    timing["ci95"] = [-0.1, 1.1]
    assert "port" not in summarise("consistent", pump=pump)


def test_what_remains_is_told_with_place_and_law():
    """Its size, element, interval and law, and the network that stands in for it."""
    remainder = {
        "misfit": 0.08,
        "model_error": 0.069,
        "element": "segment 1",
        "position_m": [0.12, 0.14],
        "law": "a compliance or an inertance (proportional to jw)",
        "stand_in": {"form": "shunt one-port", "passive": True},
    }
    sentence = summarise("unexplained", remainder=remainder)
    assert "What then remains, beside errors of the pump's ripple, is 6.9 % of the read" in sentence
    assert "It is in segment 1, 0.12 to 0.14 m from the pump." in sentence
    assert "It behaves like a compliance or an inertance (proportional to jw)." in sentence
    assert "In the twin a network (shunt one-port, passive) stands in for it." in sentence
    between = summarise("unexplained", remainder=remainder | {"element": "between pump and p2"})
    assert "It is between the pump and p2, 0.12 to 0.14 m from the pump." in between
    nowhere = summarise("unexplained", remainder=remainder | {"element": None})
    assert "No single element accounts for it." in nowhere


@pytest.mark.parametrize(
    ("names", "pressures", "is_gas", "told"),
    [
        (["entrained_air", "leak"], (9e6,), False, ["any liquid that stiffens"]),
        (["entrained_air"], (9e6, 9.4e6), False, ["any liquid that stiffens"]),
        (["entrained_air", "line_volume"], (9e6, 9.5e6), False, []),
        (["entrained_air", "line_volume"], (None,), False, []),
        (["load_volume"], (9e6,), False, ["a small volume of gas"]),
        (["load_volume"], (9e6,), True, []),
        (["unsteady_friction"], (9e6,), False, []),
    ],
)
def test_what_one_pressure_cannot_tell_apart(names, pressures, is_gas, told):
    """At pressures within 5 % a liquid that stiffens fits as well as entrained air, and gas as well
    as a volume of liquid. The sentences say so there, and nowhere else."""
    observations = [SimpleNamespace(load_pressure=p) for p in pressures]
    said = pressure_sentences(names, observations, is_gas)
    assert len(said) == len(told)
    assert all(words in sentence for words, sentence in zip(told, said))


def test_a_wrong_ripple_is_told_apart_from_a_wrong_line():
    """With the nominal ripple a misfit of 40 % beside a model error of 1 % is the ripple's, and
    both misfits are told; one of 2 % is not."""
    fit = {"model_error": {"after": 0.01}, "after": {"in_sample": 0.02}}
    observations = [SimpleNamespace(source="nominal")]
    (sentence,) = ripple_sentences(observations, fit | {"nominal_ripple": {"in_sample": 0.4}})
    assert "misses 40 % of the reading" in sentence and "2.0 %" in sentence.replace("\u00a0", " ")
    assert ripple_sentences(observations, fit | {"nominal_ripple": {"in_sample": 0.02}}) == []


def test_an_unknown_load_and_uncalibrated_sensors_are_told():
    """At the ends and the middle of the band; a phase of 0.1 rad is 5.7 degrees."""
    load = {
        "frequency_hz": [100.0, 800.0, 1500.0],
        "reflection": {"re": [0.3, 0, 0], "im": [0.4, 0.1, 0]},
    }
    (said,) = load_sentences(load)
    assert "0.50 at 100 Hz, 0.10 at 800 Hz and 0.00 at 1500 Hz" in said
    (said,) = sensor_sentences({"m2": {"gain": {"value": 1.12}, "phase": {"value": 0.1}}})
    assert "m2 1.120 (phase +5.7°)" in said
    assert load_sentences(None) == [] and sensor_sentences({}) == []


def test_numbers_have_no_power_of_ten():
    """A resonance is at 3004 Hz, not at 3e+03 Hz; 1.3e9 Pa are 1.3 GPa."""
    pump = {
        "frequency": {"value": 3004.0, "ci95": [2998.0, 3010.0], "sheet": 2500.0, "unit": "Hz"},
        "bulk_modulus": {"value": 1.3e9, "ci95": [1.2e9, 1.4e9], "sheet": 1.7e9, "unit": "Pa"},
    }
    sentence = summarise("consistent", pump=pump)
    assert "frequency 3004 Hz (data sheet 2500 Hz)" in sentence
    assert "bulk modulus 1.30 GPa (data sheet 1.7 GPa)" in sentence


def explained(
    verdict="named",
    levels=("established", "established", "supported"),
    leak=EFFECTS["leak"],
    disagreement=None,
    held_out_error=0.05,
    **result,
):
    """The paragraphs of a verdict with a delay of two sensors and a leak between p1 and p2.

    `disagreement` is that of the second delay, `held_out_error` the model error on data left out.
    """
    rig, seconds = paper_rig(), {"value": 5e-6, "ci95": [4e-6, 6e-6], "unit": "s"}
    place = {"value": 1.0, "ci95": [0.9, 1.1], "unit": "m"}
    entries = [
        {
            "effect": EFFECTS["sensor_delay"],
            "place": Place(f"sensor {sensor.name}", k),
            "parameters": {"delay": seconds},
        }
        for k, sensor in enumerate(rig.sensors[:2])
    ]
    entries.append(
        {"effect": leak, "place": leak.places(rig)[0], "parameters": {"position": place}}
    )
    supports = [
        Support(x["effect"].name, str(x["place"]), level, None, 1.0, 0.0)
        for x, level in zip(entries, levels, strict=True)
    ]
    supports[1] = replace(supports[1], disagreement=disagreement)
    rival = SimpleNamespace(
        effect="source_impedance", place="source (volume)", misfit=0.003, parameter="length[2]",
        value=1.6, nominal=1.8, unit="m", pull=10.0, rivals=True,
    )  # fmt: skip
    load = {**vars(rival), "parameter": "load", "value": 0.395, "nominal": 1.0, "unit": ""}
    sheet = SimpleNamespace(tolerance_scale=1.0)
    twin = SimpleNamespace(parameters=(), theta=(), effects=(), rig=sheet)
    e = SimpleNamespace(
        rig=rig,
        shaft_orders=None,
        observations=[SimpleNamespace(source="known", load_pressure=7e6)],
        prior_sensitivity=[rival, SimpleNamespace(**load)],
        alarms=SimpleNamespace(raised=(), pull=(0.1, "load")),
        search=SimpleNamespace(leading_fits=()),
        source_free_fits=(),
        decision=SimpleNamespace(
            accepted=SimpleNamespace(hypothesis=(1,), twin=twin, label=""),
            supports=supports,
            established=tuple(s.name for s in supports if s.level == "established"),
        ),
    )
    scores = {"held_out": 0.5, "in_sample": 0.5}
    fit = {"before": scores, "after": {"held_out": 0.02}, "expected_gain": {"after": 0.1}}
    fit["model_error"] = {"held_out": held_out_error, "after": 0.02}
    whole = {"verdict": verdict, "fit": fit, "next_recording": None, "pump": {}, "load": None}
    whole |= {"sensors": {}, "remainder": None, "equivalents": []} | result
    return describe_verdict(e, whole, entries).split("\n")


def test_a_named_verdict_begins_with_what_is_missing():
    """Effects of one name are told together, a position in metres; what is less certain comes after
    what is established, and numbers come last."""
    first, *rest = explained()
    assert first.startswith("The twin lacks delay of sensors p1 and p2. This is established. ")
    assert "the error on data that were left out falls from 50 % to 2.0 % of the ripple" in first
    assert "Supported only: leak in segment 1 (0.90 to 1.10 m from the pump)." in first
    assert rest[0].startswith(
        "Values, with 95 % intervals in brackets. Delay of sensor p1: 5.0 µs (4"
    )


def test_values_that_contradict_the_law_are_told():
    """With and without the recording that disagrees, in units of a test bench; values that differ
    by no more than errors do are not told."""
    name = "sensor_delay@sensor p2.delay"
    differs = Disagreement(5.1, name, 5e-6, 9e-6, "recording healthy_1")
    first = explained(disagreement=differs)[0]
    assert first.endswith(
        "Values change where a part of the data is left out: delay of sensor p2, delay 5.00 µs "
        "with all data and 9.00 µs without recording healthy_1. The law of the effect does not "
        "allow that, so other physics acts there."
    )
    assert "left out:" not in explained(disagreement=replace(differs, deviations=5.0))[0]


def test_an_explanation_that_does_not_carry_over_says_so():
    """Above 5 % of model error on data that were left out; at 5 % nothing is said."""
    said = explained(held_out_error=0.051)[0]
    assert "by 5.1 % on data that were left out, by 2.0 % on those that were fitted." in said
    assert "carry over" not in explained()[0]


def test_what_is_always_present_is_not_doubted():
    """An effect that is always there is told as included, whatever its support: the data sheet's
    values cannot explain it away."""
    first = explained(leak=replace(EFFECTS["leak"], certain=lambda rig, place: True))[0]
    assert "Leak in segment 1 (0.90 to 1.10 m from the pump): always present" in first
    assert "Supported only" not in first


def test_a_rival_of_the_data_sheet_is_told_in_words():
    """A length in metres and a load in per cent of its nominal; neither as `length[2]`, nor as a
    number without a unit before a full stop."""
    said = explained()[-1]
    assert "speaks for volume at the pump: " in said
    assert "would fit to 0.30 % if the length of segment 2 were 1.60 m instead of 1.8 m." in said
    factor = "factor on the load's coefficient or impedance"
    assert f"if the {factor} were 39.5 % instead of 100 %." in said


def test_what_cannot_be_told_apart_comes_second_with_the_next_recording():
    """Names with places, and effects alone."""
    classes = [["sensor_delay", "sensor_dynamics"], ["leak at 0.50 m", "leak at 1.00 m"]]
    _, second, *_ = explained(equivalents=classes, next_recording="a third sensor")
    assert second == (
        "These recordings cannot tell apart: delay of a sensor and resonance of a sensor; "
        "leak 0.50 m from the pump and leak 1.00 m from the pump. Next recording: a third sensor."
    )


@pytest.mark.parametrize("verdict", ["named", "ambiguous", "unexplained"])
@pytest.mark.parametrize("law", ["a resonator (imaginary part through zero)", None])
def test_no_identifier_and_no_lost_unit_is_left(verdict, law):
    """Underscores, indices in brackets, a space before a full stop and "between pump" are not."""
    remainder = {
        "model_error": 0.004, "element": "between pump and load", "position_m": [0.0, 8.0],
        "law": law,
        "stand_in": {"form": "series one-port", "passive": True, "beside": [
            {"form": "shunt one-port", "parameters": {"position": {"value": 4.8}}, "follows": law}
        ]},
    }  # fmt: skip
    text = "\n".join(
        explained(
            verdict,
            equivalents=[["sensor_gain at sensor p1", "sensor_gain at sensor p2"]],
            remainder=remainder,
        )
    )
    assert not re.search(r"_|\[| \.|\.\.|between pump|and load|None|\d%", text), text
