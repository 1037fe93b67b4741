"""Answers are taken again where nothing that they were made from has changed, and only there.

The twin's fit and the diagnosis itself are stand-ins that note what they are asked: what is proven
is which recordings are diagnosed after which edit.
"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from case_folders import ripple, sheet, write_case, write_hdf5
from made_results import DIAGNOSIS, made_change
from rippletwin.case.load import load_case
from rippletwin.diagnosis import kept_answers
from rippletwin.diagnosis.diagnose import select_recordings
from rippletwin.diagnosis.faults.library import select_faults
from rippletwin.diagnosis.kept_answers import diagnose_changed, digest
from rippletwin.diagnosis.pump_calibration import RecalibratedTwin
from rippletwin.twin.twin import Twin
from run_script import run_script

UNKNOWN = ("first", "second")


@pytest.fixture
def case(tmp_path):
    """A folder with a healthy recording and two of unknown state."""
    content = sheet()
    for seed, name in enumerate(UNKNOWN):
        add(content, tmp_path, name, 2.0 * seed)
    write_case(tmp_path, content)
    return tmp_path


def add(content, folder, name, offset=100.0):
    point = content["recordings"][0]
    content["recordings"].append(point | {"file": f"{name}.h5", "state": "unknown"})
    write_hdf5(folder / f"{name}.h5", ripple() + offset)


@pytest.fixture
def asked(monkeypatch):
    """What is calculated, in order: "twin", or the label of a recording."""
    done = []

    def refit(twin, healthy, read):
        done.append("twin")
        return RecalibratedTwin(twin)

    def diagnose(diagnoser, recording, anchors, read):
        done.append(recording.label)
        return recording.label

    monkeypatch.setattr(kept_answers, "recalibrate_twin", refit)
    monkeypatch.setattr(kept_answers, "diagnose_one", diagnose)
    monkeypatch.setattr(kept_answers, "entry_of", lambda label: DIAGNOSIS | {"label": label})
    monkeypatch.setattr(kept_answers, "gather", made_change)
    return done


def run(folder, twin=None, faults=None, labels=()):
    """Diagnose the case in `folder`; returns the labels in the answers."""
    read = load_case(folder)
    answers = diagnose_changed(
        read,
        twin or Twin(read.rig),
        select_recordings(read, labels),
        faults or select_faults(),
        folder / "out",
    )
    assert [a.numbers.label for a in answers] == [a.entry["label"] for a in answers]
    return [a.entry["label"] for a in answers]


def test_a_second_call_calculates_nothing(case, asked):
    """The same answers in the same order."""
    assert run(case) == run(case) == list(UNKNOWN)
    assert asked == ["twin", *UNKNOWN]


def test_how_far_the_fit_of_the_pump_converged_is_kept_with_the_twin(case, asked, monkeypatch):
    """A recording that is diagnosed later, by the twin that was kept, is doubted as the first."""
    gains = []
    monkeypatch.setattr(
        kept_answers, "recalibrate_twin", lambda twin, *_: RecalibratedTwin(twin, expected_gain=5.0)
    )

    def diagnose(diagnoser, recording, *_):
        gains.append(diagnoser.expected_gain)
        return recording.label

    monkeypatch.setattr(kept_answers, "diagnose_one", diagnose)
    run(case, labels=UNKNOWN[:1])
    monkeypatch.setattr(kept_answers, "recalibrate_twin", None)
    run(case, labels=UNKNOWN[:1] + UNKNOWN[1:])
    assert gains == [5.0, 5.0]


def test_a_recording_that_is_added_is_the_only_one_that_is_diagnosed(case, asked):
    """Wherever in the sheet it stands; the twin is not fitted again either."""
    run(case)
    content = sheet()
    add(content, case, "third")
    for name in UNKNOWN:
        content["recordings"].append(content["recordings"][0] | {"file": f"{name}.h5"})
        content["recordings"][-1]["state"] = "unknown"
    write_case(case, content)
    assert run(case) == ["third", *UNKNOWN]
    assert asked == ["twin", *UNKNOWN, "third"]


def test_a_recording_that_is_taken_again_is_diagnosed_again(case, asked):
    """Its file has the same name and other samples."""
    run(case)
    write_hdf5(case / "second.h5", ripple() + 7.0)
    run(case)
    assert asked[3:] == ["second"]


@pytest.mark.parametrize(
    "edit",
    [
        lambda content: content["fluid"].update(density=871.0),
        lambda content: content["recordings"][0].update(speed_rpm=1000.5),
    ],
    ids=["the rig", "the healthy recording"],
)
def test_what_all_answers_depend_on_makes_all_again(case, asked, edit):
    """The rig, and the healthy recording that the twin and the changes are measured by."""
    run(case)
    content = sheet()
    edit(content)
    for name in UNKNOWN:
        point = content["recordings"][0] | {"speed_rpm": 1000.0, "state": "unknown"}
        content["recordings"].append(point | {"file": f"{name}.h5"})
    write_case(case, content)
    run(case)
    assert asked[3:] == ["twin", *UNKNOWN]


def test_another_twin_and_other_faults_make_all_again(case, asked):
    """A twin whose one number differs in the last digit; the library's further fault."""
    run(case)
    twin = Twin(load_case(case).rig)
    run(case, twin.with_(theta=twin.theta + np.finfo(float).eps))
    assert asked[3:] == ["twin", *UNKNOWN]
    run(case, twin, select_faults(["valve_plate"]))
    assert asked[6:] == ["twin", *UNKNOWN]


def test_another_program_makes_all_again(case, asked, monkeypatch):
    """An answer of an older version is not mixed with those of a newer one."""
    run(case)
    monkeypatch.setattr(kept_answers, "digest_program", lambda: "newer")
    run(case)
    assert asked[3:] == ["twin", *UNKNOWN]


def test_a_damaged_file_is_not_taken(case, asked):
    """A kept answer that was cut off is made again."""
    run(case)
    path = case / "out" / "kept" / "recordings" / "first.json"
    path.write_text(path.read_text()[:100])
    run(case)
    assert asked[3:] == ["first"]


def test_what_a_recording_is_called_after_and_where_it_lies_makes_no_difference(case):
    """The digest of a recording has its content, not its file or what its state is said to be."""
    recording = load_case(case).recordings[1]
    moved = replace(recording, file=Path("elsewhere.csv"), state="slipper")
    assert digest(recording) == digest(moved)
    assert digest(recording) != digest(replace(recording, label="other"))
    assert digest(recording) != digest(replace(recording, pressure=recording.pressure[::-1]))


def test_the_workflow_diagnoses_what_is_new(case, asked, monkeypatch):
    """The script's second run, on a case with one recording more; diagnosis.json has all three, and
    the warnings that the pump is a generic one and that the healthy recordings contradict
    themselves, as the verdict says."""
    read = load_case(case)
    monkeypatch.setattr("rippletwin.twin.twin_file.load_twin", lambda *files: Twin(read.rig))
    monkeypatch.setattr("rippletwin.figures.fault_posterior.draw", lambda numbers, folder: [])

    (case / "verdict.json").write_text('{"verdict": "bad_data"}')

    def job():
        run_script(
            "diagnose",
            case,
            output={"diagnosis": str(case / "out" / "diagnosis.json")},
            wildcards={},
            params={"faults": []},
            rig=str(case / "rig.yaml"),
            twin="",
            verdict=str(case / "verdict.json"),
        )
        return json.loads((case / "out" / "diagnosis.json").read_text())

    assert len(job()["recordings"]) == 2
    content = sheet()
    for name in UNKNOWN:
        content["recordings"].append(content["recordings"][0] | {"file": f"{name}.h5"})
        content["recordings"][-1]["state"] = "unknown"
    add(content, case, "third")
    write_case(case, content)
    written = job()
    assert [each["label"] for each in written["recordings"]] == [*UNKNOWN, "third"]
    assert asked == ["twin", *UNKNOWN, "third"]
    assert any("generic pump" in warning for warning in written["warnings"])
    assert any("contradict themselves" in warning for warning in written["warnings"])
