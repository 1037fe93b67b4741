"""rippletwin export: files against the signal that was recorded."""

import csv
import json

import numpy as np
import pytest
from scipy.io import loadmat

from case_folders import sheet, write_case
from leaking_pump import rig
from rippletwin.case.load import load_case
from rippletwin.cli import main
from rippletwin.spectra.observation import observe
from rippletwin.twin.state_space import line_response
from rippletwin.twin.twin import Twin
from rippletwin.twin.twin_file import to_dict


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """A case whose signal is known (case_folders.ripple), and the folder of its export."""
    case = tmp_path_factory.mktemp("case")
    write_case(case, sheet())
    twin = Twin(rig())
    data = {"twin": to_dict(twin), "covariance": (0.25 * np.eye(len(twin.theta))).tolist()}
    (case / "twin.json").write_text(json.dumps(data))
    command = ["export", str(case), "--out", str(case / "out"), "--twin", str(case / "twin.json")]
    assert main([*command, "--state-space"]) == 0
    return case / "out"


def columns(path) -> dict[str, np.ndarray]:
    with open(path) as file:
        head, *rows = csv.reader(file)
    return dict(zip(head, np.array(rows, dtype=float).T))


def test_inverse_fft_of_the_spectrum_is_the_ripple(exported):
    """Peak amplitudes put into numpy's own inverse FFT, with the file's mean, give the ripple."""
    spectrum = columns(exported / "healthy_0_spectrum.csv")
    ripple = columns(exported / "healthy_0_ripple.csv")
    count = len(ripple["time_s"])
    for name in ("p1", "p2"):
        bins = np.zeros(count // 2 + 1, complex)
        bins[spectrum["order"].astype(int)] = spectrum[f"{name}_re"] + 1j * spectrum[f"{name}_im"]
        bins[0] = 2.0 * ripple[name].mean()
        found = np.fft.irfft(bins * count / 2, count)
        np.testing.assert_allclose(found, ripple[name], atol=1e-3)


def test_amplitudes_are_those_of_the_recorded_signal(exported):
    """The cosines that were recorded, 1e5/sqrt(9 k) Pa on 95 bar, p2 at 0.7 of them and 1 rad
    ahead, are found within 0.5 %; frequencies are those of 1000 r/min."""
    spectrum = columns(exported / "healthy_0_spectrum.csv")
    orders = spectrum["order"].astype(int)
    np.testing.assert_allclose(spectrum["frequency_hz"], orders * 1000 / 60, rtol=1e-4)
    at = np.searchsorted(orders, 9 * np.arange(1, 6))
    p1, p2 = (spectrum[f"{n}_re"][at] + 1j * spectrum[f"{n}_im"][at] for n in ("p1", "p2"))
    np.testing.assert_allclose(abs(p1), 1e5 / np.sqrt(9 * np.arange(1, 6)), rtol=5e-3)
    np.testing.assert_allclose(p2 / p1, 0.7 * np.exp(1j) * np.ones(5), rtol=5e-3)
    assert columns(exported / "healthy_0_ripple.csv")["p1"].mean() == pytest.approx(9.5e6, rel=1e-4)


def test_mat_holds_what_the_tables_hold(exported):
    """MATLAB's file has the same ripple and spectrum, one row for each sensor."""
    mat = loadmat(exported / "healthy_0.mat", squeeze_me=True)
    ripple = columns(exported / "healthy_0_ripple.csv")
    np.testing.assert_array_equal(mat["ripple"], [ripple["p1"], ripple["p2"]])
    spectrum = columns(exported / "healthy_0_spectrum.csv")
    np.testing.assert_array_equal(mat["spectrum"].imag[1], spectrum["p2_im"])
    assert list(mat["sensors"]) == ["p1", "p2"]


def test_twin_has_values_with_units(exported):
    """A twin at its data sheet has the sheet's numbers; a coordinate known to half a standard
    deviation has half the sheet's uncertainty, 5 % of the wave speed."""
    values = json.loads((exported / "twin_values.json").read_text())["values"]
    speed = values["wave_speed[1]"]
    assert speed["unit"] == "m/s" and speed["value"] == pytest.approx(1200.0)
    assert speed["sd"] == pytest.approx(0.5 * 0.05 * 1200.0, rel=0.01)


def test_state_space_is_the_twins_line(exported):
    """The matrices in JSON and in MAT, at a frequency between the fitted ones, give what the twin's
    line responds there (`line_response`, the transfer matrices); the stated error holds."""
    data = json.loads((exported / "healthy_0_state_space.json").read_text())
    mat = loadmat(exported / "healthy_0_state_space.mat")
    a, b, c, d = (np.array(data[name]) for name in "ABCD")
    np.testing.assert_array_equal(mat["A"], a)
    assert data["outputs"] == ["pump outlet", "p1", "p2"]
    frequency = np.array([333.3, 1234.5])
    found = [c @ np.linalg.solve(2j * np.pi * f * np.eye(len(a)) - a, b) + d for f in frequency]
    case = load_case(exported.parent)
    observation = observe(case.recordings[0], case.rig)
    expected = line_response(Twin(rig()), observation, frequency)
    np.testing.assert_allclose(np.array(found)[:, :, 0].T, expected, rtol=5e-3)
    assert max(data["relative_error"]) < 2e-3


def test_a_band_limits_spectrum_and_ripple(tmp_path):
    """Only shaft orders between 400 and 1000 Hz are written, and the ripple is made of them: a tone
    of 150 Hz is not in it."""
    write_case(tmp_path, sheet())
    band = ["--min-frequency", "400", "--max-frequency", "1000"]
    assert main(["export", str(tmp_path), "--out", str(tmp_path / "out"), *band]) == 0
    orders = columns(tmp_path / "out/healthy_0_spectrum.csv")["order"]
    assert orders[0] in (24, 25) and orders[-1] in (59, 60)
    ripple = columns(tmp_path / "out/healthy_0_ripple.csv")["p1"]
    assert abs(np.fft.rfft(ripple)[9]) < 1e-6 * abs(np.fft.rfft(ripple)[27])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--recording", "nothing"], "There are healthy_0"),
        (["--twin", "none.json"], "cannot be read"),
        (["--state-space"], "--twin"),
        (["--max-frequency", "1"], "no frequency of the recording is between"),
    ],
)
def test_what_makes_no_sense_is_refused(tmp_path, capsys, options, words):
    """Exit code 2, one line, and nothing is written."""
    write_case(tmp_path, sheet())
    command = ["export", str(tmp_path), "--out", str(tmp_path / "out"), *options]
    assert main(command) == 2
    told = capsys.readouterr()
    assert words in told.err.splitlines()[-1] and told.out == ""
    assert not (tmp_path / "out").exists()
