"""A recording of unknown state: networks are asked about it, and nothing else of a run sees it."""

import json

import pytest

from case_folders import ripple, sheet, write_case, write_hdf5
from noise_networks import kept, saved
from rippletwin import store
from run_script import run_script

STATES = {"first": "unknown", "good": "healthy", "leak": "slipper", "later": "unknown"}


@pytest.fixture
def case(tmp_path):
    """A case with two recordings of unknown state at the diagnosed point, a third one elsewhere,
    and one that is no recording at all."""
    content = sheet()
    point = content["recordings"].pop()
    for name, state in [*STATES.items(), ("elsewhere", "unknown")]:
        load = 7e6 if name == "elsewhere" else point["load_pressure"]
        entry = point | {"file": f"{name}.h5", "state": state, "load_pressure": load}
        content["recordings"].append(entry)
        write_hdf5(tmp_path / f"{name}.h5", ripple() - 9.5e6 + load)
    write_case(tmp_path, content, pressure=None)
    return tmp_path


def test_windows_are_cut_from_recordings_of_known_state(case):
    """The store has the healthy and the faulty recording; a damaged one of unknown state is not
    even opened."""
    (case / "later.h5").write_bytes(b"damaged")
    run_script(
        "cut_windows",
        case,
        output={"windows": str(case / "pressure.zarr")},
        wildcards={},
        params={"windows": 10, "samples": 3072},
        rig=str(case / "rig.yaml"),
    )
    windows = store.load(case / "pressure.zarr")
    assert windows.source == "good.h5, leak.h5" and windows.labels == ["good", "leak"]
    assert sorted(set(windows.state.values)) == ["H", "S"]


def test_networks_are_asked_about_recordings_of_unknown_state(case):
    """Those at the networks' operating point, each by each network; the table has a row each. Of
    signals that are no noise every window is unlike what the networks know."""
    networks = [str(saved(case, kept(seed, name))) for seed, name in enumerate(("CFD-R", "CFD-S"))]
    run_script(
        "ask_networks",
        case,
        output={"answers": str(case / "networks.json"), "page": str(case / "networks.md")},
        wildcards={},
        params={},
        rig=str(case / "rig.yaml"),
        networks=networks,
    )
    answers = json.loads((case / "networks.json").read_text())
    assert list(answers) == ["first", "later"]
    assert list(answers["later"]) == ["cnn1d_341_100@CFD-R", "cnn1d_341_100@CFD-S"]
    assert {said["state"] for said in answers["first"].values()} == {"unlike"}
    assert (
        "| later | cnn1d_341_100@CFD-S | unlike | 100 | 100 |" in (case / "networks.md").read_text()
    )
