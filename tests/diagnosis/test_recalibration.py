"""Line and pump as healthy recordings tell them, for a twin that has neither right.

Independent truth: the pump coupled to its pipe step by step in time, of known numbers.
"""

from dataclasses import replace

import numpy as np
import pytest

import leaking_pump
from rippletwin.calibration.laplace import UNCONVERGED_GAIN
from rippletwin.diagnosis import diagnose, pump_calibration
from rippletwin.diagnosis.diagnose import healthy_misfit, recalibrate_twin
from rippletwin.diagnosis.line_calibration import calibrate_line
from rippletwin.diagnosis.pump_calibration import calibrate_pump, one_each_point
from rippletwin.diagnosis.pump_flow import simulate_healthy_pump, with_fitted_pump
from rippletwin.errors import InputError
from rippletwin.harmonics import peak_amplitudes
from rippletwin.twin.twin import Twin


@pytest.fixture(scope="module")
def healthy():
    """Two healthy recordings of a line whose waves are 2 % slower than the data sheet's."""
    rng = np.random.default_rng(3)
    slow = 0.98 * leaking_pump.WAVE_SPEED
    return [leaking_pump.record(n, rng=rng, wave_speed=slow) for n in ("one", "two")]


def test_ratios_between_sensors_give_the_delay_whatever_the_pump_is_said_to_be(healthy):
    """A twin that believes in another pump, and whose diameter made up for it, finds the true
    delay between its sensors to 0.1 % and gives the diameter back. The wave speed itself is known
    no better than the positions: a line 1 % longer with waves 1 % faster has the same ratios.
    """
    twin = Twin(leaking_pump.rig(), healthy)
    theta = twin.theta.copy()
    theta[twin.index["diameter[1]"]] = 6.0
    biased = twin.with_(theta=theta)
    found = calibrate_line(biased, healthy).values()
    distance = found["position[p2]"] - found["position[p1]"]
    delay = (3.0 - 0.5) / (0.98 * leaking_pump.WAVE_SPEED)
    assert distance / found["wave_speed[1]"] == pytest.approx(delay, rel=1e-3)
    assert found["wave_speed[1]"] == pytest.approx(0.98 * leaking_pump.WAVE_SPEED, rel=0.01)
    assert found["diameter[1]"] == pytest.approx(leaking_pump.DIAMETER, rel=0.05)


def test_the_pump_s_flow_comes_nearer_to_the_true_one(healthy):
    """A data sheet whose ports open three times too fast, over oil of too little air: the fitted
    pump's flow errs by less than half as much at the pistons' orders, whatever numbers it takes.
    The load pressure is not stated: the sensors' means tell it."""
    rig = leaking_pump.rig()
    rig = replace(rig, pump=rig.pump | {"port_opening_deg": 10.0, "air_fraction": 1e-4})
    unstated = [replace(o, load_pressure=None) for o in healthy]
    line = calibrate_line(Twin(rig, unstated), unstated)
    fitted = calibrate_pump(line, one_each_point(unstated), rig.pump).twin.rig.pump
    point = leaking_pump.OIL, leaking_pump.SPEED, leaking_pump.LOAD
    orders = leaking_pump.PISTONS * np.arange(1, 13)
    true, sheet, found = (
        np.abs(peak_amplitudes(simulate_healthy_pump(pump, *point).flow)[orders])
        for pump in (leaking_pump.TRUE, line.rig.pump, fitted)
    )
    assert np.linalg.norm(found - true) < 0.5 * np.linalg.norm(sheet - true)


def test_a_fit_of_the_pump_that_is_cut_short_promises_more(healthy, monkeypatch):
    """Through the true line the usual number of evaluations ends where a step gains nothing that
    decides; one evaluation does not."""
    rig = leaking_pump.rig()
    twin = Twin(replace(rig, pump=rig.pump | {"port_opening_deg": 10.0}), healthy)
    theta, k = twin.theta.copy(), twin.index["wave_speed[1]"]
    theta[k] = twin.parameters[k].prior.coordinate(0.98 * leaking_pump.WAVE_SPEED)
    fit = twin.with_(theta=theta), one_each_point(healthy), twin.rig.pump
    assert calibrate_pump(*fit).expected_gain < UNCONVERGED_GAIN
    monkeypatch.setattr(pump_calibration, "EVALUATIONS", 1)
    assert calibrate_pump(*fit).expected_gain > UNCONVERGED_GAIN


def test_a_band_above_what_tells_the_pump_leaves_it_as_it_is(healthy):
    """Recordings from 2.6 kHz on: no order of the pistons is left below the highest that counts."""
    high = [replace(o, min_frequency_hz=2600.0) for o in healthy]
    twin = Twin(leaking_pump.rig(), high)
    found = calibrate_pump(twin, high, twin.rig.pump)
    assert found.twin.rig.pump == leaking_pump.SHEET and found.expected_gain == 0.0


def test_a_pump_that_the_twin_has_fitted_amiss_is_fitted_about_the_data_sheet(healthy):
    """Port timing and overlap of the given twin are three and two of their tolerances off, as a fit
    leaves them where its model error takes up the difference. The pump that a diagnosis takes has
    the true timing to half a degree, its tolerance."""
    twin = Twin(leaking_pump.rig(), healthy, uncertain_pump=True)
    theta, k = twin.theta.copy(), twin.index["wave_speed[1]"]
    theta[k] = twin.parameters[k].prior.coordinate(0.98 * leaking_pump.WAVE_SPEED)
    theta[twin.index["port_timing"]], theta[twin.index["port_overlap"]] = 3.0, -2.0
    amiss = twin.with_(theta=theta)
    assert with_fitted_pump(amiss).rig.pump["port_timing_deg"] > 1.0
    found = recalibrate_twin(amiss, healthy, lambda observation: (observation, 0.0))
    timing = with_fitted_pump(found.twin).rig.pump["port_timing_deg"]
    assert timing == pytest.approx(leaking_pump.TRUE["port_timing_deg"], abs=0.5)


def test_a_pump_that_cannot_be_simulated_is_an_error_that_names_the_recordings(
    healthy, monkeypatch
):
    """What the simulation of a pump raises reaches the user with the recordings and a remedy."""

    def fail(*_):
        raise ArithmeticError("pressure of a chamber does not converge")

    monkeypatch.setattr(diagnose, "calibrate_line", fail)
    with pytest.raises(InputError, match=r"recordings one, two.*does not converge.*Correct them"):
        recalibrate_twin(Twin(leaking_pump.rig(), healthy), healthy, lambda o: (o, 0.0))


def test_an_operating_point_set_twice_is_fitted_once(healthy):
    """Two recordings of one speed and load pressure."""
    assert len(one_each_point(healthy)) == 1


def test_the_misfit_of_healthy_ripples_prefers_the_right_line(healthy):
    """A twin with the true wave speed reproduces the healthy ripples better than one whose wave
    speed is 6 % off, so it is the one that a diagnosis keeps."""
    twin = Twin(leaking_pump.rig(), healthy)
    misfits = []
    for factor in (0.98, 1.04):
        theta = twin.theta.copy()
        k = twin.index["wave_speed[1]"]
        speed = factor * leaking_pump.WAVE_SPEED
        theta[k] = twin.parameters[k].prior.coordinate(speed)
        misfits.append(healthy_misfit(twin.with_(theta=theta), healthy))
    assert misfits[0] < 0.5 * misfits[1]
