"""A layout that the file has not, and files that are not what their name says: told in one line."""

import pytest

from case_folders import RATE, refused, ripple, sheet, write_case
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
    "another's own channel": ({"p2": "p1"}, "channels.p2", ["p1 is the channel of p1 too"]),
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


def test_a_number_and_a_name_of_one_channel(tmp_path):
    """The second column is called a: which sensor it belongs to is not said."""
    content = sheet()
    content["recordings"][0] |= {"file": "r.csv", "channels": {"p1": 2, "p2": "a"}}
    write_case(tmp_path, content, pressure=None)
    (tmp_path / "r.csv").write_text("time_s,a,b\n0,1,2\n1e-4,2,3\n")
    refused(tmp_path, "r.csv", "p2", "number 2 of the file, is that of p1 too")


def test_a_link_in_a_zarr_store_is_not_followed(tmp_path):
    """It may lead to files outside of the case."""
    zarr = pytest.importorskip("zarr")
    content = sheet()
    content["recordings"][0]["file"] = "r.zarr"
    write_case(tmp_path, content, pressure=None)
    store = zarr.open_group(tmp_path / "r.zarr", mode="w")
    store.create_array("pressure", data=ripple()).attrs["sampling_rate_hz"] = RATE
    (tmp_path / "r.zarr" / "pressure").rename(tmp_path / "elsewhere")
    (tmp_path / "r.zarr" / "pressure").symlink_to(tmp_path / "elsewhere")
    refused(tmp_path, "r.zarr", "pressure", "a link", "Copy what it leads to")


def test_a_parquet_table_with_one_name_twice(tmp_path):
    """The columns are chosen by number, and read by name."""
    pa = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    content = sheet()
    content["recordings"][0] |= {"file": "r.parquet", "channels": {"p1": 1, "p2": 2}}
    write_case(tmp_path, content, pressure=None)
    table = pa.Table.from_arrays([pa.array(row) for row in ripple()], names=["a", "a"])
    parquet.write_table(table, tmp_path / "r.parquet")
    refused(tmp_path, "r.parquet", "a", "two columns have this name", "Rename")


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
