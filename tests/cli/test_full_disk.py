"""A disk without room, under each command that writes several files or a large one.

A limit of a file's size stands in for the disk, and what is calculated is made up: what is proven
is what is on the disk afterwards, and what is said.
"""

import resource
from contextlib import contextmanager
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

from case_folders import ripple, write_hdf5
from made_results import DIAGNOSIS, VERDICT, made_change, write_results
from rippletwin.case.load import load_case
from rippletwin.cli import main
from rippletwin.diagnosis import kept_answers, simulated_fault
from rippletwin.diagnosis.pump_calibration import RecalibratedTwin
from rippletwin.diagnosis.simulated_fault import SimulatedFault
from rippletwin.explanation import explain
from rippletwin.explanation.verdict import verdict_file
from rippletwin.twin.twin import Twin

ROOM = 30_000  # bytes of a file
TOO_MUCH = "x" * 4 * ROOM


@contextmanager
def full_disk():
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (ROOM, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.fixture
def case(tmp_path):
    """A case of a healthy and an unknown recording, with results of explain and diagnose."""
    return write_results(tmp_path)


def refuse(capsys, file, *command):
    """Run a command without room: it ends with one line that names file, reason and remedy."""
    with full_disk():
        assert main([*map(str, command)]) == 2
    said = [line for line in capsys.readouterr().err.splitlines() if "warning: " not in line]
    assert said == [
        f"rippletwin: {file}: not written: File too large. Allow larger files and run it again; "
        "what was finished is kept"
    ]


def files_of(folder):
    """Every file below a folder that is new here, scratch files too, with its content."""
    return {str(p.relative_to(folder)): p.read_text() for p in folder.rglob("*") if p.is_file()}


def test_a_page_without_room(case, capsys):
    """The page of an earlier call is whole, and nothing is beside it."""
    out = case / "page" / "report.html"
    out.parent.mkdir()
    out.write_text("old")
    refuse(capsys, out, "report", case, "--out", out)
    assert files_of(out.parent) == {"report.html": "old"}
    assert main(["report", str(case), "--out", str(out)]) == 0
    assert "</html>" in out.read_text()[-20:]


def test_a_verdict_without_room(case, capsys, monkeypatch):
    """The verdict of an earlier call is whole, and no twin of this one is beside it."""
    twin = Twin(load_case(case).rig)
    found = SimpleNamespace(
        twin=twin,
        decision=SimpleNamespace(accepted=SimpleNamespace(covariance=np.eye(len(twin.theta)))),
    )
    monkeypatch.setattr(explain, "explain", lambda *_: found)
    monkeypatch.setattr(verdict_file, "verdict_dict", lambda _: VERDICT | {"sentence": TOO_MUCH})
    out = case / "out"
    out.mkdir()
    (out / "verdict.json").write_text("old")
    refuse(capsys, out / "verdict.json", "explain", case, "--out", out, "--no-figures")
    assert files_of(out) == {"verdict.json": "old"}


def test_answers_of_a_diagnosis_without_room(case, capsys, monkeypatch):
    """The first recording's answer is kept and the second's is not there; diagnosis.json is that of
    before. With room only the second is diagnosed."""
    write_hdf5(case / "later.h5", ripple() + 1.0)
    content = yaml.safe_load((case / "rig.yaml").read_text())
    healthy, unknown = content["recordings"]
    second = unknown | {"file": "later.h5", "label": "later"}
    content["recordings"] = [healthy, unknown | {"label": "first"}, second]
    (case / "rig.yaml").write_text(yaml.safe_dump(content))
    asked = []

    def diagnose(diagnoser, recording, *_):
        asked.append(recording.label)
        return recording.label

    room = []
    monkeypatch.setattr(kept_answers, "recalibrate_twin", lambda twin, *_: RecalibratedTwin(twin))
    monkeypatch.setattr(kept_answers, "diagnose_one", diagnose)
    monkeypatch.setattr(kept_answers, "gather", made_change)
    monkeypatch.setattr(
        kept_answers,
        "entry_of",
        lambda label: (
            DIAGNOSIS
            | {"label": label, "sentence": TOO_MUCH if label == "later" and not room else label}
        ),
    )
    out = case / "out"
    out.mkdir()
    (out / "diagnosis.json").write_text("old")
    command = ["diagnose", case, "--out", out, "--no-figures"]
    command += ["--twin", case / "explained" / "twin.json"]
    refuse(capsys, out / "kept" / "recordings" / "later.json", *command)
    left = files_of(out)
    assert set(left) == {"diagnosis.json", "kept/twin.json", "kept/recordings/first.json"}
    assert left["diagnosis.json"] == "old" and asked == ["first", "later"]
    room.append(True)
    assert main([*map(str, command)]) == 0
    assert asked == ["first", "later", "later"]
    assert capsys.readouterr().out == "first\nlater\n"


def test_a_simulation_without_room(case, capsys, monkeypatch):
    """A table that does not fit leaves neither a piece of itself nor a scratch file."""
    run = SimulatedFault(0.0, np.arange(9000.0), np.ones((2, 9000)), 1e-3)
    monkeypatch.setattr(simulated_fault, "simulate_fault", lambda *_: run)
    out = case / "runs" / "run.csv"
    command = ["simulate", "healthy", "--twin", case / "explained" / "twin.json"]
    command += ["--speed", "1000", "--pressure", "95", "--out", out]
    refuse(capsys, out, *command)
    assert not files_of(out.parent)
