"""Networks of a rig: the signals that teach them, and the flow that those of the kinds Q judge."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import leaking_pump
from diagnosis_trial import networks
from diagnosis_trial.taught_signals import TaughtSignals
from rippletwin.case.model import Case, Recording
from rippletwin.flow_sensor.estimate import band_limit
from rippletwin.learning.architectures import CLASSES
from rippletwin.twin.twin import Twin

RATE, SAMPLES = 51200.0, 3072
SPEED_HZ = leaking_pump.SPEED / 60.0
REVOLUTIONS = 12


@pytest.fixture(scope="module")
def twin():
    """The twin of the data sheet's rig, not fitted."""
    return Twin(leaking_pump.rig(), [])


@pytest.fixture(scope="module")
def source(twin):
    """What the twin teaches where the healthy recording is of silence."""
    silence = np.zeros((3, len(leaking_pump.SENSORS), SAMPLES))
    return TaughtSignals(twin, None, silence, SPEED_HZ, leaking_pump.LOAD)


def recording(revolution, label="a", state="unknown"):
    """Revolutions (S, M) one after the other, with the load pressure as their mean."""
    pressure = np.tile(revolution, REVOLUTIONS) + leaking_pump.LOAD
    noise = np.random.default_rng(1).standard_normal(pressure.shape)
    return Recording(
        Path("a.h5"), "periodic", state, label, leaking_pump.SPEED, leaking_pump.LOAD, RATE,
        pressure + 20.0 * noise,
    )  # fmt: skip


@pytest.mark.parametrize("name", CLASSES)
def test_the_line_turns_simulated_pressure_into_the_flow_that_made_it(twin, source, name):
    """Flow by the line in the frequency domain from pressure in the time domain is the pump's."""
    at = CLASSES.index(name)
    pressure, flow = (source.draw(kind, 1, np.random.default_rng(0))[at, 0] for kind in ("P", "Q"))
    found = networks._flow_windows(recording(pressure), twin.rig, twin, SPEED_HZ)
    expected = band_limit(flow, SPEED_HZ, networks.BANDWIDTH_HZ)[0]
    spectra = np.abs(np.fft.rfft(found[:, 0])).mean(axis=0), np.abs(np.fft.rfft(expected))
    error = np.linalg.norm(spectra[0] - spectra[1]) / np.linalg.norm(spectra[1])
    assert error < 0.02


def test_kinds_of_fixed_leaks_repeat_one_signal_a_class(source):
    """P and Q are the paper's, one simulation a class: at the sensors and at the pump."""
    rng = np.random.default_rng(0)
    for kind, channels in {"P": 2, "Q": 1}.items():
        drawn = source.draw(kind, 2, rng)
        assert drawn.shape == (len(CLASSES), 2, channels, SAMPLES)
        np.testing.assert_array_equal(drawn[:, 0], drawn[:, 1])


def test_a_network_of_flow_answers_recordings_of_its_operating_point(twin, monkeypatch):
    """It knows one channel, and is not asked about another pressure."""
    monkeypatch.setattr(networks, "DRAWS", 20)
    monkeypatch.setattr(networks, "HELD_OUT", 20)
    monkeypatch.setattr(networks, "SETTINGS", replace(networks.SETTINGS, max_epochs=1))
    pressure = TaughtSignals(
        twin, None, np.zeros((3, 2, SAMPLES)), SPEED_HZ, leaking_pump.LOAD
    ).draw("P", 1, np.random.default_rng(0))[0, 0]
    case = Case(Path("case"), twin.rig, [recording(pressure, "healthy", "healthy")])
    asked = [recording(pressure, "b"), replace(recording(pressure, "c"), load_pressure=5e6)]
    kept = networks.teach_network("Q", twin, None, case)
    assert (kept.signal, kept.channels) == ("flow", ["outlet"])
    (entry,) = networks.ask_network(kept, asked, twin.rig, twin)["recordings"]
    assert entry["label"] == "b" and sum(entry["probabilities"].values()) == pytest.approx(1.0)
