"""Networks that the workflow keeps, and what they say of a recording."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

import leaking_pump
from case_folders import ripple, sheet, write_case, write_hdf5
from noise_networks import SAMPLES, kept, saved
from rippletwin.case.model import Recording
from rippletwin.cli import main
from rippletwin.diagnosis.network_answers import ask_networks, find_networks, judge_windows
from rippletwin.errors import InputError
from rippletwin.learning.kept_networks import KeptNetworks, load_networks

RATE = 51200.0


def test_kept_networks_answer_as_before(tmp_path):
    """Classes and p-values are the same after a file that holds tensors and plain data only."""
    before = kept()
    after = load_networks(saved(tmp_path, before))
    windows = np.random.default_rng(5).standard_normal((7, 2, SAMPLES))
    for one, other in zip(before.answers(windows), after.answers(windows), strict=True):
        np.testing.assert_array_equal(one, other)
    assert after.classes == ("H", "S", "C1", "C2") and after.channels == ["p1", "p2"]


def test_a_file_of_another_format_is_refused(tmp_path):
    """What its networks and p-values mean is not known: the message says so, and what to do."""
    path = saved(tmp_path, kept())
    data = torch.load(path, weights_only=True)
    del data["format"]  # as before there were formats
    torch.save(data, path)
    with pytest.raises(InputError, match=r"format.*is 1.*make it anew"):
        load_networks(path)


def test_either_severity_is_a_cylinder_and_shares_are_counted():
    """By hand: of eight answers five are C1 or C2, three S; one in eight is unlike."""
    said = np.array([[2, 3, 2, 1], [1, 1, 3, 2]])
    p_values = np.array([[0.5, 0.5, 0.04, 0.5], [0.9] * 4])
    classes = "H", "S", "C1", "C2"
    found = judge_windows(classes, said, p_values)
    assert found == {"state": "cylinder", "share": 5 / 8, "unlike": 1 / 8}
    p_values[:] = 0.01
    p_values[0, :2] = 0.9
    found = judge_windows(classes, said, p_values)
    assert found == {"state": "unlike", "share": 0.75, "unlike": 0.75}


def recording(label, speed_rpm=1000.0, amplitude=1e4):
    """Half a second of a ripple of nine pistons."""
    time = np.arange(int(0.5 * RATE)) / RATE
    wave = amplitude * np.sin(2 * np.pi * 9 * speed_rpm / 60 * time)
    return Recording(
        Path("a.h5"), "periodic", "unknown", label, speed_rpm, 9.5e6, RATE, np.array([wave, wave])
    )


def test_each_recording_is_asked_at_the_networks_operating_point(tmp_path):
    """A ripple that noise has never shown is unlike it; at another speed nobody is asked."""
    saved(tmp_path, kept())
    rig = leaking_pump.rig()
    networks = find_networks(tmp_path, rig)
    assert list(networks) == ["cnn1d_341_100"]
    answers = ask_networks(networks, [recording("here"), recording("there", 1200.0)], rig)
    assert answers["there"] == {}
    assert answers["here"]["cnn1d_341_100"]["state"] == "unlike"


def test_windows_have_the_sensors_in_the_networks_order(tmp_path, monkeypatch):
    """Networks that have learnt p2 before p1 are shown p2 first: each channel is what it was."""
    saved(tmp_path, kept(channels=["p2", "p1"]))
    rig = leaking_pump.rig()
    taken = recording("here")
    taken = replace(taken, pressure=taken.pressure * [[1.0], [3.0]])
    shown = []

    def answers(networks, windows):
        shown.append(windows)
        return np.zeros((1, len(windows)), int), np.ones((1, len(windows)))

    monkeypatch.setattr(KeptNetworks, "answers", answers)
    ask_networks(find_networks(tmp_path, rig), [taken], rig)
    first, second = shown[0].std(axis=(0, 2))
    assert first == pytest.approx(3.0 * second)


def test_networks_of_several_datasets_are_called_after_both(tmp_path):
    """Otherwise one would hide the other."""
    saved(tmp_path, kept())
    saved(tmp_path, kept(dataset="CFD-MOC-PRA"))
    names = find_networks(tmp_path, leaking_pump.rig())
    assert set(names) == {"cnn1d_341_100@CFD-MOC-PR", "cnn1d_341_100@CFD-MOC-PRA"}


def test_folders_without_usable_networks_are_named(tmp_path):
    """None at all, networks of flow only, of one sensor, of sensors with other names, and a file
    that is something else."""
    rig = leaking_pump.rig()
    with pytest.raises(InputError, match="no networks that judge pressure"):
        find_networks(tmp_path, rig)
    path = saved(tmp_path, kept(signal="flow"))
    with pytest.raises(InputError, match="no networks that judge pressure"):
        find_networks(tmp_path, rig)
    saved(tmp_path, kept(channels=["p1"]))
    with pytest.raises(InputError, match="from the sensors p1, and the case has p1, p2"):
        find_networks(tmp_path, rig)
    saved(tmp_path, kept(channels=["p1", "outlet"]))
    with pytest.raises(InputError, match="from the sensors p1, outlet, and the case has p1, p2"):
        find_networks(tmp_path, rig)
    torch.save({"weights": []}, path)
    with pytest.raises(InputError, match="holds no kept networks"):
        find_networks(tmp_path, rig)
    path.write_text("nothing")
    with pytest.raises(InputError, match="holds no kept networks"):
        find_networks(tmp_path, rig)


def test_a_folder_without_networks_ends_the_command_before_anything_is_fitted(tmp_path, capsys):
    """Exit code 2 and one line that names the option, not after minutes of explaining."""
    content = sheet()
    second = content["recordings"][0] | {"file": "tomorrow.h5", "state": "unknown"}
    content["recordings"].append(second)
    case = tmp_path / "case"
    case.mkdir()
    write_case(case, content)
    write_hdf5(case / "tomorrow.h5", ripple())
    options = ["--out", str(tmp_path / "out"), "--networks", str(tmp_path)]
    assert main(["diagnose", str(case), *options]) == 2
    assert "--networks: there are no networks" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
