"""Which effects recordings could tell apart, without a fit: against what is known beforehand."""

from dataclasses import replace

import numpy as np
import pytest

from rippletwin.calibration.posterior import Posterior
from rippletwin.calibration.reading_errors import FIRST_SOURCE_SD
from rippletwin.case.model import Fluid, Load, Rig, Segment, Uncertainty
from rippletwin.case.recording_advice import BAND_HZ
from rippletwin.explanation.search.stepwise_search import applicable_candidates
from rippletwin.explanation.stages.preparation import HIGHEST_HZ
from rippletwin.explanation.thresholds import LITTLE_MODEL_ERROR
from rippletwin.explanation.verdict.expected_confusion import (
    CHANGE,
    _Rival,
    describe_discriminations,
    expect_discriminations,
)
from rippletwin.explanation.verdict.next_experiment import FLAT_VARIANCE
from rippletwin.spectra.observation import Observation
from rippletwin.twin.twin import Twin
from synthetic_observations import make

ONE_PRESSURE = ((1000, 9.5e6), (1200, 9.5e6))
TWO_PRESSURES = ((1000, 9.5e6), (1200, 2e6))


def found(sensors=2, points=ONE_PRESSURE, source="nominal", noise=2e3):
    """Name -> what recordings of the paper's line can tell of an effect."""
    rig, observations, _ = make(
        np.random.default_rng(0), sensors=sensors, points=points, noise=noise
    )
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


def test_noise_hides_effects_behind_a_free_source_too():
    """A line volume that two quiet sensors notice is lost in noise as large as the ripple: the
    readings are as large as in the recordings, not those of a unit flow."""
    quiet, loud = (found(source="free", noise=sd)["line_volume"].evidence for sd in (2e3, 5e7))
    assert loud < 0.01 * quiet


def test_air_needs_a_second_pressure(nominal):
    """At one pressure air is a lower wave speed: what it is beside the wave speed is seen only
    where the pressure changes its volume."""
    assert found(points=TWO_PRESSURES)["entrained_air"].evidence > 3 * (
        nominal["entrained_air"].evidence
    )


def test_effects_are_equally_strong(nominal):
    """Every effect that has a size changes the ripple by the same share, but for two that cannot
    be so small: a sensor's resonance and a side hole."""
    larger = ("unsteady_friction", "sensor_dynamics", "side_hole")
    for name, one in nominal.items():
        if name not in larger:
            assert one.change == pytest.approx(CHANGE, rel=0.011), name


def test_a_loss_is_that_of_a_posterior_of_its_own(nominal):
    """One model serves all losses of a rival. A posterior that is made of the other's readings, and
    its Jacobian, give the same."""
    rig, observations, _ = make(np.random.default_rng(0), sensors=2, points=ONE_PRESSURE)
    applicable = {e.name: (e, place) for e, place in applicable_candidates(rig, observations)}
    truth = Twin(rig, observations, effects=[applicable["sensor_gain"]])
    truth = truth.with_(theta=np.append(np.zeros(len(truth.theta) - 1), 0.3))
    seen = [replace(o, values=v) for o, v in zip(observations, truth.predict(observations))]
    twin = Twin(rig, observations, effects=[applicable["unsteady_friction"]])
    posterior = Posterior(twin, seen)
    posterior.model_error = LITTLE_MODEL_ERROR
    posterior.source_sd = posterior.smooth_sd = FIRST_SOURCE_SD
    r, jacobian = posterior.linearise(twin.theta, posterior.predict(twin.theta))
    count = 2 * posterior.values.size
    priors = np.diag([FLAT_VARIANCE if p.flat else 1.0 for p in twin.parameters])
    covariance = np.eye(count) + jacobian[:count] @ priors @ jacobian[:count].T
    loss = 0.5 * r[:count] @ np.linalg.solve(covariance, r[:count])
    assert _Rival(twin, observations).loss(posterior.values) == pytest.approx(loss, rel=1e-6)


def test_an_impedance_is_compared_with_itself():
    """A twin loses nothing by the input impedance that it predicts, and something by another."""
    line, no_sensors = (Segment(4.0, 0.02, 1000.0),), ()
    rig = Rig(Fluid(870.0, 3.2e-5), {"pistons": 9}, line, no_sensors, Load("closed"), Uncertainty())
    frequency_hz = np.linspace(40.0, 2000.0, 80)
    values = np.full((1, 80), 2.0 + 1.0j)
    observation = Observation(
        "input_impedance", "one", frequency_hz, None, values, np.full((80, 1, 1), 1e-6 + 0j),
        np.zeros(1), None, None, "known", None, no_sensors, True,
    )  # fmt: skip
    rival = _Rival(Twin(rig, [observation]), [observation])
    assert rival.loss(rival.readings) == 0.0
    assert rival.loss(1.05 * rival.readings) > 1.0


def test_every_effect_is_told_once_in_words(nominal):
    """What is noticed and what is absorbed are all effects, each once."""
    head, noticed, absorbed, *_ = describe_discriminations(list(nominal.values()))
    names = ", ".join(line.split(": ")[1] for line in (noticed, absorbed))
    told = [name for name in names.split(", ") if name != "none"]
    assert sorted(told) == sorted(name.replace("_", " ") for name in nominal)
    assert "5 %" in head


def test_advice_is_about_the_band_that_is_fitted():
    """The advice on sampling rates and the fit speak of the same frequencies."""
    assert BAND_HZ == HIGHEST_HZ
