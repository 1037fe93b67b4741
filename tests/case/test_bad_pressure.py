"""Pressures that are none: raw counts, a wrong sign, several sensors at once. Times beside them."""

import json
from pathlib import Path

import h5py
import numpy as np
import pytest

from case_folders import RATE, refused, ripple, sheet, write_case
from rippletwin.case.load import load_case
from rippletwin.case.readers.signals import Signals
from rippletwin.case.signal_checks import sampling_rate
from rippletwin.cli import main
from rippletwin.errors import InputError, InputErrors


def test_raw_counts_of_a_converter(tmp_path):
    """Sixteen-bit counts, 600 Pa each, are told as counts and not as MPa only."""
    counts = np.round(ripple() / 600).astype(np.int16)
    write_case(tmp_path, sheet(), counts)
    with pytest.raises(InputErrors) as caught:
        load_case(tmp_path)
    assert [error.field for error in caught.value.errors] == ["p1", "p2"]
    for error in caught.value.errors:
        assert "raw counts" in error.problem and "scale, Pa a count" in error.remedy


def test_whole_pascals_are_no_counts(tmp_path):
    """Pressures stored as whole numbers of Pa are read."""
    write_case(tmp_path, sheet(), np.round(ripple()).astype(np.int32))
    case = load_case(tmp_path)
    assert case.recordings[0].pressure.dtype == float
    assert not [w for w in case.warnings if "whole numbers" in w]


def test_whole_numbers_without_a_mean_may_be_counts(tmp_path):
    """Of an AC-coupled sensor nothing tells counts from pascals: a warning asks for the scale. It
    says nothing where one sample is no whole number, or the scale is stated."""
    content = sheet()
    whole = np.round(ripple() - 9.5e6)
    broken = whole.copy()
    broken[1, 2000] += 0.5
    for pressure, names in ((whole, "p1, p2"), (broken, "p1")):
        write_case(tmp_path, content, pressure)
        (told,) = [w for w in load_case(tmp_path).warnings if "whole numbers" in w]
        assert told.startswith(f"healthy_0: {names}: whole numbers only; give scale")
    content["recordings"][0]["scale"] = 1
    write_case(tmp_path, content, whole)
    assert not [w for w in load_case(tmp_path).warnings if "whole numbers" in w]


def test_pascals_called_bar(tmp_path):
    """Of an AC-coupled sensor, whose mean tells nothing: its ripple, 1e5 times too large, is far
    more than the load pressure."""
    content = sheet()
    content["recordings"][0]["unit"] = "bar"
    write_case(tmp_path, content, ripple() - 9.5e6)
    with pytest.raises(InputErrors, match="correct unit, scale or load_pressure"):
        load_case(tmp_path)


def test_inverted_pressure(tmp_path):
    """A mean of -9.5 MPa is below vacuum."""
    pressure = ripple()
    pressure[1] *= -1
    write_case(tmp_path, sheet(), pressure)
    refused(tmp_path, "healthy_0.h5", "p2", "sign is inverted", "Multiply")


def test_faults_of_all_sensors_and_recordings_are_told_at_once(tmp_path):
    """NaN in one, a stuck sensor in both rows of another: three errors of two files."""
    content = sheet()
    first = content["recordings"][0]
    content["recordings"] = [first, {**first, "file": "second.h5"}]
    pressure = ripple()
    pressure[0, 5] = np.nan
    write_case(tmp_path, content, pressure)
    with h5py.File(tmp_path / "second.h5", "w") as file:
        file["pressure"] = np.full((2, 51200), 9.5e6)
        file.attrs["sampling_rate_hz"] = RATE
    with pytest.raises(InputErrors) as caught:
        load_case(tmp_path)
    told = [(error.file.split("/")[-1], error.field) for error in caught.value.errors]
    assert told == [("healthy_0.h5", "p1"), ("second.h5", "p1"), ("second.h5", "p2")]


def test_the_row_of_a_gap_in_time_is_the_real_one(tmp_path):
    """The clock jumps before row 5001."""
    content = sheet()
    content["recordings"][0]["file"] = "r.csv"
    write_case(tmp_path, content, pressure=None)
    pressure = ripple(0.3)
    time = np.arange(pressure.shape[1]) / RATE
    time[5000:] += 0.01
    table = np.column_stack([time, *pressure])
    np.savetxt(tmp_path / "r.csv", table, delimiter=",", header="time_s,p1,p2", comments="")
    refused(tmp_path, "r.csv", "time_s", "not evenly spaced (first at row 5001)")


def rate_of(time):
    """The sampling rate that a column of times states."""
    pressure = np.zeros((1, time.size), np.float32)
    return sampling_rate(Path("r.h5"), Signals(pressure, time_s=time), None)


def test_times_of_single_precision():
    """Their rounding is no dropped sample: up to 200 s at 51.2 kHz it is less than a step. Samples
    that are dropped are still told. After 300 s the rounding is more than a step, and that is said.
    The rate is a plain number, which JSON takes."""
    time = np.arange(10_000) / RATE
    for start in (0.0, 199.0):
        rate = rate_of((start + time).astype(np.float32))
        assert rate == pytest.approx(RATE, rel=1e-3) and type(rate) is float
    with pytest.raises(InputError, match=r"not evenly spaced \(first at row 301\)"):
        rate_of(np.delete(time, slice(300, 303)).astype(np.float32))
    with pytest.raises(InputError, match="single precision rounds the times to"):
        rate_of((300.0 + time).astype(np.float32))
    assert rate_of(300.0 + time) == pytest.approx(RATE, rel=1e-9)


def test_check_prints_times_of_single_precision_as_json(tmp_path, capsys):
    """A rate that follows from them reaches the summary of a long recording."""
    content = sheet()
    content["recordings"][0]["kind"] = "random"
    write_case(tmp_path, content, pressure=None)
    noise = np.random.default_rng(0).normal(9.5e6, 1e5, (2, 8192))
    with h5py.File(tmp_path / "healthy_0.h5", "w") as file:
        file["pressure"] = noise
        file["time_s"] = (np.arange(8192) / RATE).astype(np.float32)
    assert main(["check", str(tmp_path), "--json"]) == 0
    (told,) = json.loads(capsys.readouterr().out)["recordings"]
    assert told["seconds"] == pytest.approx(0.16)
