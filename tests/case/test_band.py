"""The band of a recording that is fitted, and the warning where plane waves are not alone."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import jvp

from case_folders import spoilt, told
from rippletwin.case.band import FIRST_CROSS_MODE, plane_wave_limit
from rippletwin.case.load import load_case
from rippletwin.case.model import Fluid, Load, Rig, Segment
from rippletwin.cli import main
from rippletwin.errors import InputError
from rippletwin.spectra.frequency_selection import check_sources, select_fitted_frequencies
from rippletwin.spectra.observation import observe


def banded(folder, **keys):
    """A case whose one recording has more keys."""
    spoilt(folder, lambda content: content["recordings"][0].update(keys))
    return folder


def test_the_limit_is_the_first_zero_of_j1s_slope():
    """A wave across a circular pipe travels where J1'(pi f D/a) = 0 (Rayleigh 1896): the widest
    slow segment decides."""
    zero = brentq(lambda x: jvp(1, x), 1.0, 2.5)
    assert zero == pytest.approx(FIRST_CROSS_MODE, abs=1e-3)
    line = (Segment(1.0, 0.05, 343.0), Segment(1.0, 0.1, 343.0))
    limit, segment = plane_wave_limit(
        Rig(Fluid(1.2, 1.5e-5, 1.4, 0.71), {}, line, (), Load("open"))
    )
    assert segment == 2 and limit == pytest.approx(zero * 343.0 / (np.pi * 0.1), rel=1e-3)


def test_only_the_band_is_fitted(tmp_path):
    """Of the harmonics every 150 Hz those from 300 to 500 Hz are fitted; the command line narrows
    the sheet's band and does not widen it."""
    folder = banded(tmp_path, min_frequency_hz=200.0, max_frequency_hz=500.0)
    for band, low, high in (((None, None), 300, 450), ((310.0, 2000.0), 450, 450)):
        case = load_case(folder, band_hz=band)
        observed = observe(case.recordings[0], case.rig)
        (fitted,) = select_fitted_frequencies([observed], case.rig)
        assert fitted.frequency_hz[0] == pytest.approx(low, rel=2e-3)
        assert fitted.frequency_hz[-1] == pytest.approx(high, rel=2e-3)
    assert observed.orders[0] == 1  # shaft orders below are analysed all the same


def test_a_band_without_anything_is_bad_input(tmp_path):
    """Ends in the wrong order, in the sheet or beside the command line; a band between lines."""
    with pytest.raises(InputError) as caught:
        load_case(banded(tmp_path, min_frequency_hz=900.0, max_frequency_hz=500.0))
    told(caught.value, "rig.yaml", "recordings[0].min_frequency_hz", "not below")
    folder = banded(tmp_path, max_frequency_hz=500.0)
    with pytest.raises(InputError, match="--min-frequency"):
        load_case(folder, band_hz=(600.0, None))
    case = load_case(banded(tmp_path, min_frequency_hz=452.0, max_frequency_hz=453.0))
    with pytest.raises(InputError, match="no frequency"):
        observe(case.recordings[0], case.rig)


@pytest.mark.parametrize("keys", [{"max_frequency_hz": 100.0}, {"min_frequency_hz": 4990.0}])
def test_a_band_without_a_fitted_frequency_is_bad_input(tmp_path, keys):
    """Shaft orders are in the band, and no multiple of the pistons' 150 Hz: nothing is left to
    fit, which is told with the recording's name."""
    case = load_case(banded(tmp_path, **keys))
    observed = observe(case.recordings[0], case.rig)
    with pytest.raises(InputError) as caught:
        select_fitted_frequencies([observed], case.rig)
    told(caught.value, "healthy_0", "min_frequency_hz, max_frequency_hz", "piston frequency")


def behind_a_table(folder, **keys):
    """A case whose load was measured from 200 to 600 Hz; its recording has more keys."""

    def spoil(content):
        content["load"] = {"impedance": "load.csv"}
        content["recordings"][0].update(keys)

    spoilt(folder, spoil)
    (folder / "load.csv").write_text("frequency_hz,re,im\n200,4e9,0\n600,4e9,1e9\n")
    return folder


@pytest.mark.parametrize("fit", ["calibrate", "explain", "check"])
def test_a_load_that_was_not_measured_at_a_fitted_frequency_is_bad_input(
    tmp_path, capsys, monkeypatch, fit
):
    """Multiples of 150 Hz lie beyond either end of the table. Both ranges and the keys that narrow
    the band are told, before anything is fitted."""
    monkeypatch.setattr("rippletwin.calibration.frequency_continuation.choose_starts", None)
    command = [fit, str(behind_a_table(tmp_path))]
    assert main(command if fit == "check" else [*command, "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert "load.impedance, frequency_hz: the table reaches from 200 to 600 Hz" in said
    assert "healthy_0 is fitted from 150" in said
    assert "min_frequency_hz: 200 and max_frequency_hz: 600" in said
    assert "--min-frequency, --max-frequency" in said


def test_a_band_within_the_table_of_the_load_is_fitted(tmp_path):
    """Shaft orders below the band are not fitted, and are no reason to refuse the table."""
    case = load_case(behind_a_table(tmp_path, min_frequency_hz=200, max_frequency_hz=590))
    observed = observe(case.recordings[0], case.rig)
    assert observed.frequency_hz[0] < 20.0
    (fitted,) = select_fitted_frequencies([observed], case.rig)
    np.testing.assert_allclose(fitted.frequency_hz, [300, 450], rtol=2e-3)


def test_a_table_may_begin_at_0_hz(tmp_path):
    """No wave has that frequency: its row is left out, and the others are as they are."""

    def impedance(content):
        content["recordings"][0] = {"file": "z.csv", "kind": "input_impedance", "state": "healthy"}

    spoilt(tmp_path, impedance, pressure=None)
    (tmp_path / "z.csv").write_text("frequency_hz,re,im\n0,1e9,0\n10,1e9,1e9\n20,1e9,2e9\n")
    case = load_case(tmp_path)
    observed = observe(case.recordings[0], case.rig)
    assert observed.frequency_hz.tolist() == [10.0, 20.0]
    assert observed.values.tolist() == [[1e9 + 1e9j, 1e9 + 2e9j]]


@pytest.mark.parametrize(
    ("diameter", "top", "warned"), [(0.02, None, False), (0.14, None, True), (0.14, 4000.0, False)]
)
def test_a_warning_above_the_plane_wave_limit(tmp_path, diameter, top, warned):
    """A pipe of 14 cm has waves across from 4.2 kHz on: up to the usual 5 kHz there is a warning,
    which names recording and segment; up to 4 kHz, or in a pipe of 2 cm, there is none."""

    def widen(content):
        content["line"]["segments"][1]["diameter"] = diameter
        if top is not None:
            content["recordings"][0]["max_frequency_hz"] = top

    spoilt(tmp_path, widen)
    warnings = [w for w in load_case(tmp_path).warnings if "travel too" in w]
    assert bool(warned) == bool(warnings)
    assert not warned or ("healthy_0" in warnings[0] and "segment 2" in warnings[0])


def test_a_band_wider_than_the_data_is_told_as_what_is_used(tmp_path):
    """max_frequency_hz may lie above all that was recorded: at 51.2 kHz nothing above 20.48 kHz is
    used, of a table nothing above its last row."""

    def widen(content):
        content["line"]["segments"][1]["diameter"] = 0.14
        content["recordings"][0]["max_frequency_hz"] = 1e5

    def table(content):
        widen(content)
        del content["recordings"][0]["load_pressure"], content["recordings"][0]["speed_rpm"]
        content["recordings"][0] |= {"kind": "input_impedance", "file": "z.csv"}

    spoilt(tmp_path, widen)
    assert "used up to 2.048e+04 Hz" in " ".join(load_case(tmp_path).warnings)
    spoilt(tmp_path, table, pressure=None)
    (tmp_path / "z.csv").write_text("frequency_hz,re,im\n10,1e9,1e9\n6000,1e9,2e9\n")
    assert "used up to 6000 Hz" in " ".join(load_case(tmp_path).warnings)


def test_one_sensor_beside_an_unknown_source_is_bad_input():
    """Any line makes any reading of one sensor, if the source may be anything: calibration says so.
    With a second sensor, or a source that is known, it does not."""
    one, two = (
        SimpleNamespace(label="noise", source="free", values=np.ones((count, 3), complex))
        for count in (1, 2)
    )
    with pytest.raises(InputError) as caught:
        check_sources([one])
    told(caught.value, "noise", "sensors", "the line cannot be fitted")
    check_sources([one, two])
    one.source = "nominal"
    check_sources([one])
