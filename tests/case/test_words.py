"""Words in place of identifiers, for everything that the library can say."""

import pytest

from paper_rig import paper_rig
from rippletwin.case.words import (
    name_effect,
    name_effects,
    name_element,
    name_hypothesis,
    name_parameter,
    name_place,
)
from rippletwin.twin.effects.library import EFFECTS, candidates
from rippletwin.twin.twin import Twin


def test_every_effect_at_every_place_is_a_phrase():
    """No identifier is left, and two places of an effect differ."""
    rig = paper_rig()
    labels = [(effect.name, str(place)) for effect, place in candidates(rig, named=True)]
    words = [name_effect(*label) for label in labels]
    assert len(words) > 10 and not [each for each in words if "_" in each]
    assert len(set(words)) == len(set(labels))


@pytest.mark.parametrize("effect", sorted(EFFECTS))
def test_every_effect_has_words_of_its_own(effect):
    """An effect that is added needs a line in `words`: underscores alone are no phrase."""
    from rippletwin.case import words

    assert effect in {*words.AT_SENSOR, *words.AT_OTHER}


def test_every_parameter_of_a_twin_is_a_phrase():
    """Of the line, the load, the sensors and the effects."""
    rig = paper_rig()
    names = [p.name for p in Twin(rig).parameters]
    for effect, place in candidates(rig, named=True):
        names += [p.name for p in effect.parameters(rig, place)]
    assert not [name for name in names if set("_[@") & set(name_parameter(name))]


def test_phrases_say_the_element_where_the_name_does_not():
    """Exact words, as they stand in figures."""
    assert name_effect("sensor_gain", "sensor p1") == "gain error of sensor p1"
    assert name_effect("load_dynamics", "load (spool)") == "dynamics of the load (spool)"
    assert name_hypothesis("viscoelastic_wall, segment 2 + unsteady_friction, line") == [
        "viscoelastic wall of segment 2",
        "unsteady friction",
    ]
    assert name_effect("source_impedance", "source (leakage)") == "leakage at the pump"
    assert name_hypothesis("") == ["nothing missing"]
    assert name_parameter("wave_speed[2]") == "wave speed of segment 2"
    assert name_parameter("position[p1]") == "position of sensor p1"
    assert name_parameter("gain[p2]") == "gain of sensor p2"
    assert name_parameter("state[cold oil]") == "wave speed during cold oil, relative"
    assert name_parameter("reflection[3]") == "Schur parameter 3 of the load"
    assert name_element("between pump and p1") == "between the pump and p1"
    assert name_element("between p1 and load") == "between p1 and the load"


def test_places_of_an_effect_are_told_as_places():
    """A distance, a stretch, and one of several at free positions."""
    assert name_effect("leak", "1.20 m") == "leak 1.20 m from the pump"
    assert name_effect("leak", "between pump and p1") == "leak between the pump and p1"
    assert name_effect("leak", "position 2") == "leak number 2"
    assert name_effect("sensor_gain") == "gain error of a sensor"


def test_effects_of_one_name_are_told_together():
    """Sensors and segments in their order; semicolons where an "and" is inside."""
    delays = [("sensor_delay", "sensor p2"), ("sensor_delay", "sensor p1")]
    assert name_effects(delays) == "delay of sensors p1 and p2"
    assert name_effects([*delays, ("leak", "position")]) == "delay of sensors p1 and p2; leak"
    assert (
        name_effects([("leak", "position"), ("entrained_air", "line")]) == "leak and entrained air"
    )
    assert name_effects([]) == ""


def test_a_sensor_may_be_called_position():
    """Only the element that is any position is told as one place; a name that holds the word stays
    as the user gave it."""
    assert name_element("position") == "one place"
    assert name_element("position, shunt") == "one place (shunt)"
    assert name_place("position") == "at one place"
    assert name_element("sensor position_1") == "sensor position_1"
    assert name_element("between pump and position 2") == "between the pump and position 2"


def test_the_load_s_factor_is_no_resistance():
    """It multiplies the coefficient of an orifice, whose resistance it divides, and the impedance
    of a load that has one: the words name both."""
    assert name_parameter("load") == "factor on the load's coefficient or impedance"
