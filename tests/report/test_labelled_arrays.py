"""Results as xarray datasets."""

from __future__ import annotations

import numpy as np
import pytest

import rippletwin
from case_folders import sheet, write_case
from leaking_pump import DIAMETER, LOAD, OIL, SPEED, WAVE_SPEED, rig
from rippletwin.diagnosis.simulated_fault import SimulatedFault
from rippletwin.report.labelled_arrays import label_spectra, to_xarray
from rippletwin.spectra.observation import Observation, observe
from rippletwin.twin.operating_point import OperatingCondition
from rippletwin.twin.twin import Twin


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    """A case whose signal is known: five piston harmonics, p2 at 0.7 of p1 and 1 rad ahead."""
    folder = tmp_path_factory.mktemp("case")
    write_case(folder, sheet())
    return rippletwin.load_case(folder)


def test_a_recording_has_time_sensors_and_units(case):
    """Pressure over seconds, the sensors by name and position as the sheet has them."""
    recorded = to_xarray(case.recordings[0], case.rig.sensors)
    assert recorded.pressure.units == "Pa" and recorded.time.units == "s"
    assert recorded.time[-1] == pytest.approx(1.0, abs=1e-4)
    assert recorded.position.sel(sensor="p2") == 2.59
    assert recorded.pressure.sel(sensor="p1").mean() == pytest.approx(9.5e6, rel=1e-4)


def test_spectra_are_found_by_sensor_and_order(case):
    """The ratio of the sensors at the third piston harmonic is the recorded one."""
    spectra = to_xarray(observe(case.recordings[0], case.rig))
    line = spectra.measured.swap_dims(frequency="order").sel(order=27)
    ratio = line.sel(sensor="p2").item() / line.sel(sensor="p1").item()
    assert ratio == pytest.approx(0.7 * np.exp(1j), rel=5e-3)
    assert spectra.measured.units == "Pa" and spectra.frequency.units == "Hz"


def test_predictions_stand_beside_what_was_measured(case):
    """A twin's prediction has the coordinates of the measured spectra, and is in their unit: of a
    source that is not known, the flow that comes nearest leaves a residual across the response."""
    observation = observe(case.recordings[0], case.rig, 1000.0)
    twin = Twin(case.rig, [observation])
    labelled = label_spectra(observation, {"predicted": twin})
    assert labelled.predicted.dims == labelled.measured.dims
    response = twin.predict([observation])[0]  # to unit flow
    left = labelled.measured.values - labelled.predicted.values
    across = np.abs(np.sum(np.conj(response) * left, axis=0))
    sizes = np.linalg.norm(response, axis=0) * np.linalg.norm(observation.values, axis=0)
    assert np.all(across < 1e-9 * sizes)


def test_a_predicted_impedance_is_an_impedance():
    """Predicted as a reflection coefficient, it is given as what was measured: Pa s/m3."""
    sheet = rig()
    frequency_hz = np.array([50.0, 120.0])
    observation = Observation(
        kind="input_impedance", label="z", frequency_hz=frequency_hz, orders=None,
        values=np.full((1, 2), 1e9 + 0j), covariance=np.tile(np.eye(1) + 0j, (2, 1, 1)), mean=None,
        speed_hz=None, load_pressure=LOAD, source="free", flow_ripple=None, sensors=(),
    )  # fmt: skip
    twin = Twin(sheet, [observation])
    found = label_spectra(observation, {"predicted": twin}).predicted.values
    unit = OIL.density * WAVE_SPEED / (np.pi / 4 * DIAMETER**2)
    np.testing.assert_allclose((found - unit) / (found + unit), twin.predict([observation])[0])


def test_a_twin_has_values_with_units():
    """At the data sheet both columns are the sheet's."""
    twin = to_xarray(
        Twin(rig(), [OperatingCondition("a", speed_hz=SPEED / 60, load_pressure=LOAD)])
    )
    speed = twin.sel(parameter="wave_speed[1]")
    assert speed.value == pytest.approx(1200.0) and speed.data_sheet == pytest.approx(1200.0)
    assert speed.unit == "m/s"


def test_a_simulated_revolution():
    """Shape and units; what has no form is told."""
    run = SimulatedFault(2e-7, np.array([0.0, 0.1]), np.ones((2, 2)), 1e-4)
    labelled = to_xarray(run, rig().sensors)
    assert labelled.pressure.sel(sensor="p2", time=0.1) == 1.0
    assert labelled.attrs["leak_area_m2"] == 2e-7
    with pytest.raises(TypeError, match="str"):
        to_xarray("nothing")
