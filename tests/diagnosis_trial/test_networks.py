"""Networks of a rig: the signals that teach them, and the flow that those of the kinds Q judge."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import leaking_pump
from diagnosis_trial import networks
from diagnosis_trial.taught_signals import fixed_signals, leak_bins
from rippletwin.case.model import Case, Recording
from rippletwin.flow_sensor.estimate import band_limit
from rippletwin.learning.architectures import CLASSES
from rippletwin.pump.outlets import ConstantPressure
from rippletwin.pump.simulation import simulate
from rippletwin.twin.twin import Twin

RATE, SAMPLES = 51200.0, 3072
SPEED_HZ = leaking_pump.SPEED / 60.0
REVOLUTIONS = 12


@pytest.fixture(scope="module")
def twin():
    """The twin of the data sheet's rig, not fitted."""
    return Twin(leaking_pump.rig(), [])


@pytest.fixture(scope="module")
def taught(twin):
    """Kind of fixed leaks -> its signals (classes, channels, M)."""
    return {kind: fixed_signals(kind, twin, SAMPLES, SPEED_HZ, leaking_pump.LOAD) for kind in "PQ"}


def recording(revolution, label="a", state="unknown"):
    """Revolutions (S, M) one after the other, with the load pressure as their mean."""
    pressure = np.tile(revolution, REVOLUTIONS) + leaking_pump.LOAD
    noise = np.random.default_rng(1).standard_normal(pressure.shape)
    return Recording(
        Path("a.h5"), "periodic", state, label, leaking_pump.SPEED, leaking_pump.LOAD, RATE,
        pressure + 20.0 * noise,
    )  # fmt: skip


@pytest.mark.parametrize("name", CLASSES)
def test_the_line_turns_simulated_pressure_into_the_flow_that_made_it(twin, taught, name):
    """Flow by the line in the frequency domain from pressure in the time domain is the pump's."""
    pressure, flow = (taught[kind][CLASSES.index(name)] for kind in "PQ")
    found = networks._flow_windows(recording(pressure), twin.rig, twin, SPEED_HZ)
    expected = band_limit(flow, SPEED_HZ, networks.BANDWIDTH_HZ)[0]
    spectra = np.abs(np.fft.rfft(found[:, 0])).mean(axis=0), np.abs(np.fft.rfft(expected))
    error = np.linalg.norm(spectra[0] - spectra[1]) / np.linalg.norm(spectra[1])
    assert error < 0.02


def test_fixed_leaks_are_the_papers(taught):
    """A signal of each class without its mean, at the sensors and at the pump; the leaks of the
    cylinder's two severities are as 0.26 to 0.77, and so nearly are the changes of flow."""
    assert taught["P"].shape == (len(CLASSES), len(leaking_pump.SENSORS), SAMPLES)
    assert taught["Q"].shape == (len(CLASSES), 1, SAMPLES)
    healthy, _, small, large = taught["Q"][:, 0]
    assert abs(healthy.mean()) < 1e-9 * np.ptp(healthy)
    changes = [np.linalg.norm(leaking - healthy) for leaking in (small, large)]
    assert changes[1] / changes[0] == pytest.approx(0.77 / 0.26, rel=0.2)


def test_drawn_leaks_are_those_that_are_diagnosed(twin):
    """Their flow by the law of the orifice is from 0.002 to 4 times the mean flow of one piston.
    The cylinder's range is halved in the logarithm."""
    bins = leak_bins(twin, SPEED_HZ, leaking_pump.LOAD)
    outlet = ConstantPressure(leaking_pump.LOAD)
    run = simulate(leaking_pump.SHEET, leaking_pump.OIL, leaking_pump.SPEED, outlet)
    velocity = 0.65 * np.sqrt(2.0 * leaking_pump.LOAD / leaking_pump.OIL.density)
    one_piston = run.flow.mean() / leaking_pump.PISTONS
    ends = np.array(bins["S"]) * velocity / one_piston
    np.testing.assert_allclose(ends, (0.002, 4.0), rtol=1e-3)
    middle = np.sqrt(np.prod(bins["S"]))
    assert bins["C1"] == pytest.approx((bins["S"][0], middle))
    assert bins["C2"] == pytest.approx((middle, bins["S"][1]))


def test_a_network_of_flow_answers_recordings_of_its_operating_point(twin, monkeypatch):
    """It knows one channel, and is not asked about another pressure."""
    monkeypatch.setattr(networks, "DRAWS", 20)
    monkeypatch.setattr(networks, "HELD_OUT", 20)
    monkeypatch.setattr(networks, "SETTINGS", replace(networks.SETTINGS, max_epochs=1))
    pressure = fixed_signals("P", twin, SAMPLES, SPEED_HZ, leaking_pump.LOAD)[0]
    case = Case(Path("case"), twin.rig, [recording(pressure, "healthy", "healthy")])
    asked = [recording(pressure, "b"), replace(recording(pressure, "c"), load_pressure=5e6)]
    kept = networks.teach_network("Q", twin, None, case)
    assert (kept.signal, kept.channels) == ("flow", ["outlet"])
    (entry,) = networks.ask_network(kept, asked, twin.rig, twin)["recordings"]
    assert entry["label"] == "b" and sum(entry["probabilities"].values()) == pytest.approx(1.0)
