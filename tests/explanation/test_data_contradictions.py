"""Contradictions in the data: each kind is found, and sound data have none."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rippletwin.calibration.frequency_continuation import fit_hypothesis
from rippletwin.explanation.checks import data_contradictions
from rippletwin.explanation.checks.data_contradictions import find_contradictions
from rippletwin.explanation.checks.sensor_wiring import find_swapped_sensors
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.twin import Twin
from synthetic_observations import make, rig

POINTS = ((1000, 9.5e6), (1500, 5e6))


@pytest.fixture(scope="module")
def healthy():
    """A bench and two observations without a contradiction."""
    return make(np.random.default_rng(1), points=POINTS)[:2]


def row(o, k, values):
    changed = o.values.copy()
    changed[k] = values
    return replace(o, values=changed)


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("effect", [None, "sensor_gain", "leak"])
def test_sound_data_do_not_contradict_themselves(seed, effect):
    """Neither data without an effect nor data with missing physics are reported."""
    place = {"sensor_gain": Place("sensor p2", 1), "leak": Place("position")}
    hypothesis = () if effect is None else ((EFFECTS[effect], place[effect]),)
    bench, observations, _ = make(np.random.default_rng(seed), hypothesis, points=POINTS)
    again = make(np.random.default_rng(seed), hypothesis, points=POINTS, noise=2.5e3)[1]
    assert find_contradictions(bench, (), observations, observations, again) == ""


def test_a_dead_sensor_is_reported(healthy):
    """A sensor that measures noise alone is named."""
    bench, (o, other) = healthy
    noise = np.sqrt(o.covariance[:, 2, 2].real) * np.exp(1j * np.arange(o.values.shape[1]))
    assert "p3 measures no ripple" in find_contradictions(bench, (), [row(o, 2, noise), other])


def test_two_sensors_with_one_signal_are_reported(healthy):
    """Two sensors two metres apart with the same signal up to a factor are named."""
    bench, (o, other) = healthy
    assert "p1 and p2 measure the same" in find_contradictions(
        bench, (), [row(o, 1, 1.03 * o.values[0]), other]
    )


def test_a_sensor_without_noise_is_reported(healthy):
    """A covariance of zeros is not that of a measurement."""
    bench, (o, other) = healthy
    assert "no noise" in find_contradictions(
        bench, (), [replace(o, covariance=0 * o.covariance), other]
    )


def test_a_mean_pressure_that_grows_downstream_is_reported(healthy):
    """A mean that grows by more than any gain error is reported. A gain error of 15 % is not, and
    neither are AC-coupled sensors."""
    bench, (o, other) = healthy
    assert "grows downstream" in find_contradictions(
        bench, (), [replace(o, mean=np.array([9.5e6, 9.4e6, 13e6])), other]
    )
    for mean in ([9.5e6, 10.9e6, 9.4e6], [10.0, -20.0, 3000.0]):
        assert find_contradictions(bench, (), [replace(o, mean=np.array(mean)), other]) == ""


def test_a_copied_recording_is_reported(healthy):
    """Two recordings with the same values under two labels are named."""
    bench, (o, _) = healthy
    assert "a copy of" in find_contradictions(bench, (), [o, replace(o, label="other")])


def test_two_halves_in_different_states_are_reported(healthy):
    """Halves that differ by a third of the ripple are reported; another shaft angle is not."""
    bench, (o, other) = healthy
    turned = replace(o, values=o.values * np.exp(0.2j * o.orders))
    assert find_contradictions(bench, (), [o, other], [o], [turned]) == ""
    changed = replace(turned, values=turned.values * np.linspace(1.5, 0.7, o.values.shape[1]))
    assert "between its halves" in find_contradictions(bench, (), [o, other], [o], [changed])


def test_the_recording_that_differs_from_its_repeats_is_reported(healthy):
    """Of three recordings of one operating point the one with half the ripple is named; one with
    slightly warmer oil is not."""
    bench, (o, other) = healthy
    warmer = o.values * np.exp(-2j * np.pi * o.frequency_hz * bench.delay * 0.004)
    same = replace(o, label="second", values=warmer * 1.001)
    odd = replace(o, label="third", values=0.5 * o.values)
    assert find_contradictions(bench, (), [o, same, other]) == ""
    assert find_contradictions(bench, (), [o, same, odd, other]).startswith(
        "third differs from every other"
    )


@pytest.mark.parametrize("clipped", [False, True])
def test_a_clipped_signal_is_reported_despite_noise(clipped):
    """A sinusoid clipped before noise is added is reported; the whole sinusoid is not."""
    rng = np.random.default_rng(2)
    wave = np.sin(0.01 * np.arange(20000)) + 1e-3 * rng.normal(size=20000)
    if clipped:
        wave = np.minimum(wave, 0.6) + 1e-3 * rng.normal(size=20000)
    recording = SimpleNamespace(pressure=wave[None], label="r")
    assert ("clipped at the top" in find_contradictions(rig(1), [recording])) == clipped


@pytest.mark.long
@pytest.mark.parametrize("what", ["sound", "exchanged", "sign"])
def test_wrong_wiring_is_reported(what):
    """Fits of the line alone recognise exchanged sensors and an inverted sign, and report nothing
    for correctly wired data."""
    bench, observations, _ = make(np.random.default_rng(3), sensors=2, points=POINTS[:1])
    if what == "exchanged":
        observations = [replace(o, values=o.values[::-1]) for o in observations]
    if what == "sign":
        observations = [replace(o, values=o.values * [[1.0], [-1.0]]) for o in observations]
    base = Twin(bench, observations)
    fit = fit_hypothesis(base, (), observations)
    words = find_swapped_sensors(base, observations, fit)
    expected = {"sound": "", "exchanged": "p1 and p2 are exchanged", "sign": "is inverted"}[what]
    assert (words == "") if not expected else (expected in words)


def test_every_contradiction_is_reported_once(healthy):
    """Two contradictions in one observation give two clauses."""
    bench, (o, other) = healthy
    bad = replace(row(o, 1, o.values[0]), covariance=0 * o.covariance)
    words = find_contradictions(bench, (), [bad, other])
    assert words.count(";") == 1 and "measure the same" in words and "no noise" in words
    assert data_contradictions.find_contradictions(bench) == ""
