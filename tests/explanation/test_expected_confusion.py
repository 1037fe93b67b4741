"""Which effects recordings could tell apart, without a fit: against what is known beforehand."""

from dataclasses import replace

import numpy as np
import pytest

from rippletwin.case.recording_advice import BAND_HZ
from rippletwin.explanation.explain import HIGHEST_HZ
from rippletwin.explanation.verdict.expected_confusion import (
    CHANGE,
    expect_discriminations,
    in_words,
)
from synthetic_observations import make

ONE_PRESSURE = ((1000, 9.5e6), (1200, 9.5e6))
TWO_PRESSURES = ((1000, 9.5e6), (1200, 2e6))


def found(sensors=2, points=ONE_PRESSURE, source="nominal"):
    """Name -> what recordings of the paper's line can tell of an effect."""
    rig, observations, _ = make(np.random.default_rng(0), sensors=sensors, points=points)
    observations = [replace(o, source=source) for o in observations]
    return {d.effect: d for d in expect_discriminations(rig, observations)}


@pytest.fixture(scope="module")
def nominal():
    """Two sensors, one pressure, a source that is known to some per cent."""
    return found()


def test_one_sensor_and_a_free_source_tell_nothing():
    """Of any reading the source's amplitude is free: nothing is left that could contradict it."""
    for one in found(sensors=1, source="free").values():
        assert one.evidence == pytest.approx(0, abs=0.01), one.effect
        assert not one.noticed and one.alike


def test_a_free_source_hides_what_is_at_the_pump(nominal):
    """The readings of two sensors in relation to each other do not depend on what is upstream of
    the first; with a nominal source something of the same effect is seen."""
    free = found(source="free")["source_impedance"]
    assert free.evidence < 0.01 < 1 < nominal["source_impedance"].evidence


def test_air_needs_a_second_pressure(nominal):
    """At one pressure air is a lower wave speed: what it is beside the wave speed is seen only
    where the pressure changes its volume."""
    assert found(points=TWO_PRESSURES)["entrained_air"].evidence > 3 * (
        nominal["entrained_air"].evidence
    )


def test_effects_are_equally_strong(nominal):
    """Every effect that has a size changes the ripple by about the same share."""
    changes = {name: d.change for name, d in nominal.items() if name != "unsteady_friction"}
    near = [name for name, change in changes.items() if 0.5 < change / CHANGE < 2]
    assert len(near) >= len(changes) - 2, changes


def test_every_effect_is_told_once_in_words(nominal):
    """What is noticed and what is absorbed are all effects, each once."""
    head, noticed, absorbed, *_ = in_words(list(nominal.values()))
    names = ", ".join(line.split(": ")[1] for line in (noticed, absorbed))
    told = [name for name in names.split(", ") if name != "none"]
    assert sorted(told) == sorted(name.replace("_", " ") for name in nominal)
    assert "5 %" in head


def test_advice_is_about_the_band_that_is_fitted():
    """The advice on sampling rates and the fit speak of the same frequencies."""
    assert BAND_HZ == HIGHEST_HZ
