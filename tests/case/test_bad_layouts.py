"""A layout that the file has not, and files that are not what their name says: told in one line."""

import pytest

from case_folders import refused, sheet, write_case
from recorder_files import NUMBERED, duct_like, hdf5

WRONG = {
    "a number too large": ({"channels": {"p1": 9, "p2": 1}}, "p1", ["4 channel(s), counted from"]),
    "a name without names": ({"channels": {"p1": "a", "p2": 1}}, "p1", ["have no names"]),
    "one sensor without a number": ({"channels": {"p1": 1}}, "p2", ["have no names", "number"]),
    "too many channels": ({}, "time_data", ["4 channel(s)", "channels: {p1: 1, ...}"]),
    "no such dataset": ({"dataset": "time_dat"}, "dataset", ["Did you mean time_data?"]),
    "no such attribute": (
        {"sampling_rate_name": "freq", **NUMBERED},
        "sampling_rate_name",
        ["freq is not in the file"],
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_layout_that_the_file_has_not(tmp_path, name):
    """The key of rig.yaml or the sensor is named, with what the file has."""
    entry, field, words = WRONG[name]
    content = sheet()
    content["recordings"][0].update({"file": "r.h5", "dataset": "time_data"} | entry)
    write_case(tmp_path, content, pressure=None)
    hdf5(duct_like)(tmp_path / "r.h5")
    refused(tmp_path, "r.h5", field, *words)


SHEETS = {
    "counted from zero": ({"p1": 0, "p2": 1}, "channels.p1", ["from 1"]),
    "a list": ({"p1": [1], "p2": 2}, "channels.p1", ["a whole number or text"]),
    "no such sensor": ({"p3": 1, "p2": 2}, "channels.p3", ["no such sensor", "name of a sensor"]),
    "one channel for two": ({"p1": 1, "p2": 1}, "channels.p2", ["the channel of p1 too"]),
}


@pytest.mark.parametrize("name", SHEETS)
def test_channels_that_make_no_sense(tmp_path, name):
    """Told from the sheet alone."""
    channels, field, words = SHEETS[name]
    content = sheet()
    content["recordings"][0]["channels"] = channels
    write_case(tmp_path, content)
    refused(tmp_path, "rig.yaml", f"recordings[0].{field}", *words)


USELESS = {
    "r.wav": {"dataset": "x"},
    "r.csv": {"orientation": "samples_by_sensors"},
    "r.parquet": {"sampling_rate_name": "fs"},
    "r.uff": {"time": "t"},
    "r.tdms": {"orientation": "samples_by_sensors"},
}


@pytest.mark.parametrize("name", USELESS)
def test_key_that_means_nothing_in_a_format(tmp_path, name):
    """It is told instead of left aside: its author expects something of it."""
    content = sheet()
    content["recordings"][0].update({"file": name} | USELESS[name])
    write_case(tmp_path, content, pressure=None)
    (tmp_path / name).write_bytes(b"not read")
    refused(tmp_path, name, next(iter(USELESS[name])), f"means nothing for a {name[1:]} file")


GARBAGE = {
    "r.wav": "not WAV",
    "r.parquet": "not Parquet",
    "r.uff": "no universal file",
    "r.unv": "no universal file",
}


@pytest.mark.parametrize("raw", [b"This is no recording. " * 50, b"\0" * 4096])
@pytest.mark.parametrize("name", GARBAGE)
def test_file_that_is_not_what_its_name_says(tmp_path, name, raw):
    """Garbage is no traceback."""
    content = sheet()
    content["recordings"][0]["file"] = name
    write_case(tmp_path, content, pressure=None)
    (tmp_path / name).write_bytes(raw)
    error = refused(tmp_path, name, "file", "cannot be read", GARBAGE[name])
    assert str(error).isprintable()


def test_folder_that_is_no_store(tmp_path):
    """An empty folder that is called a zarr store."""
    content = sheet()
    content["recordings"][0]["file"] = "r.zarr"
    write_case(tmp_path, content, pressure=None)
    (tmp_path / "r.zarr").mkdir()
    refused(tmp_path, "r.zarr", "file", "no zarr store")
