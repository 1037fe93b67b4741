"""A case that comes from anybody reads nothing but its own folder, unless its user allows more."""

import os

import pytest

from case_folders import refused, ripple, sheet, write_case, write_hdf5
from rippletwin.case.load import load_case

KEYS = ("file", "flow_ripple", "repeats", "impedance")


@pytest.fixture
def outside(tmp_path):
    """A good recording beside the folder of the case, which is returned with it."""
    folder = tmp_path / "case"
    folder.mkdir()
    write_hdf5(tmp_path / "outside.h5", ripple())
    return folder, tmp_path / "outside.h5"


def write(folder, name, key="file"):
    content = sheet()
    if key == "impedance":
        content["load"] = {"kind": "impedance", "impedance": name}
    else:
        content["recordings"][0][key] = [name] if key == "repeats" else name
    if key == "repeats":
        content["recordings"][0]["kind"] = "spectrum"
    write_case(folder, content, None)
    if key != "file":
        write_hdf5(folder / "healthy_0.h5", ripple())


def names(folder, file):
    """Ways to name a file outside: upwards, absolute, through a link to it or to its folder."""
    (folder / "link.h5").symlink_to(file)
    (folder / "data").symlink_to(file.parent)
    return ["../outside.h5", str(file), "link.h5", "data/outside.h5", "data/../outside.h5"]


@pytest.mark.parametrize("way", range(5))
def test_a_recording_outside_the_folder_is_refused(outside, way):
    """It is there and good, and not read; the message says how to allow it."""
    folder, file = outside
    write(folder, names(folder, file)[way])
    refused(folder, "rig.yaml", "recordings[0].file", "leads out", "RIPPLETWIN_DATA")


@pytest.mark.parametrize("key", KEYS)
def test_every_key_that_names_a_file_is_guarded(outside, key):
    """Flow ripples, repeats and a measured load too; whether the file is there is not told."""
    folder, _ = outside
    write(folder, "../../../../etc/passwd", key)
    field = "load.impedance" if key == "impedance" else f"recordings[0].{key}"
    field += "[0]" if key == "repeats" else ""
    error = refused(folder, "rig.yaml", field, "leads out")
    assert "no file" not in str(error)


@pytest.mark.parametrize("way", range(4))
def test_a_folder_that_the_user_allows_is_read(outside, monkeypatch, way):
    """One of two folders in the variable holds it."""
    folder, file = outside
    allowed = os.pathsep.join(["/nowhere", str(file.parent)])
    monkeypatch.setenv("RIPPLETWIN_DATA", allowed)
    write(folder, names(folder, file)[way])
    assert len(load_case(folder).recordings) == 1


def test_a_case_that_is_itself_reached_by_a_link_is_read(outside, tmp_path):
    """The folder is what the user has named."""
    folder, _ = outside
    write_case(folder, sheet())
    (tmp_path / "linked").symlink_to(folder)
    assert len(load_case(tmp_path / "linked").recordings) == 1


def test_an_upward_step_that_stays_inside_is_read(outside):
    """day1/../healthy_0.h5 is healthy_0.h5."""
    folder, _ = outside
    (folder / "day1").mkdir()
    write(folder, "day1/../healthy_0.h5")
    write_hdf5(folder / "healthy_0.h5", ripple())
    assert len(load_case(folder).recordings) == 1
