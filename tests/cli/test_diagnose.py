"""rippletwin diagnose: the exit code that --fail-on asks for, and what is refused at once."""

import json
from types import SimpleNamespace

import pytest

from case_folders import ripple, sheet, write_case, write_hdf5
from rippletwin.case.load import load_case
from rippletwin.cli import main

DONE, FOUND = 0, 3


@pytest.mark.parametrize(
    ("state", "words", "code"),
    [
        ("slipper_leak", ["fault"], FOUND),
        ("slipper_leak", ["unlike"], DONE),
        ("slipper_leak", [], DONE),
        ("unlike", ["unlike"], FOUND),
        ("unlike", ["fault"], DONE),
        ("healthy", ["fault", "unlike"], DONE),
    ],
)
def test_fail_on_a_fault_and_on_what_is_unlike_all(
    tmp_path, capsys, monkeypatch, state, words, code
):
    """Exit code 3 only where the diagnosis, a stub here, is what --fail-on names: a state that is
    unlike all that was tried is no fault. The answer is printed and written in any case."""
    write_case(tmp_path, sheet())
    entry = {"label": "healthy_0", "state": state, "sentence": f"It is {state}."}
    stub = SimpleNamespace(entry=entry, numbers=None)
    kept = "rippletwin.diagnosis.kept_answers.diagnose_changed"
    monkeypatch.setattr(kept, lambda *arguments: [stub])
    twin_of = "rippletwin.cli.diagnose._twin_of"
    monkeypatch.setattr(
        twin_of, lambda file, out, n, case, *rest: (SimpleNamespace(rig=case.rig), {})
    )
    command = ["diagnose", str(tmp_path), "--out", str(tmp_path / "out"), "--no-figures"]
    command += ["--recording", "healthy_0", *(f"--fail-on={word}" for word in words)]
    assert main(command) == code
    assert capsys.readouterr().out == f"It is {state}.\n"
    written = json.loads((tmp_path / "out/diagnosis.json").read_text())
    assert [each["state"] for each in written["recordings"]] == [state]


def test_healthy_recordings_that_contradict_themselves_are_a_warning(tmp_path, capsys, monkeypatch):
    """Without --twin the explanation's verdict `bad_data` is told on standard error and in
    diagnosis.json: the diagnosis compares with these recordings all the same."""
    write_case(tmp_path, sheet())
    entry = {"label": "healthy_0", "state": "healthy", "sentence": "It is healthy."}
    found = SimpleNamespace(twin=SimpleNamespace(rig=load_case(tmp_path).rig))
    stubs = {
        "rippletwin.diagnosis.kept_answers.diagnose_changed": lambda *_: [
            SimpleNamespace(entry=entry, numbers=None)
        ],
        "rippletwin.diagnosis.diagnose.check_recordings": lambda *_: None,
        "rippletwin.explanation.explain.explain": lambda *_: found,
        "rippletwin.explanation.verdict.verdict_file.write_verdict": lambda *_: {
            "verdict": "bad_data"
        },
    }
    for name, stub in stubs.items():
        monkeypatch.setattr(name, stub)
    out = tmp_path / "out"
    command = ["diagnose", str(tmp_path), "--out", str(out), "--no-figures"]
    assert main([*command, "--recording", "healthy_0"]) == DONE
    told = "the healthy recordings contradict themselves, as verdict.json says"
    assert told in capsys.readouterr().err
    assert told in json.loads((out / "diagnosis.json").read_text())["warnings"][0]


@pytest.fixture
def begun(monkeypatch):
    """Every call of `explain`, which takes minutes and is a stub here."""
    calls = []
    monkeypatch.setattr(
        "rippletwin.explanation.explain.explain", lambda *arguments: calls.append(arguments)
    )
    return calls


def _diagnose(folder):
    return main(["diagnose", str(folder), "--out", str(folder / "out")])


def test_a_case_without_an_anchor_is_refused_before_anything_is_explained(tmp_path, capsys, begun):
    """The only healthy recording is of broadband excitation, which `explain` could use."""
    content = sheet()
    point = content["recordings"][0]
    content["recordings"] = [
        point | {"file": "now.h5", "state": "unknown"},
        {"file": "noise.h5", "state": "healthy", "kind": "random"},
    ]
    write_case(tmp_path, content)
    write_hdf5(tmp_path / "noise.h5", ripple())
    assert _diagnose(tmp_path) == 2
    assert "no healthy periodic recording beside now" in capsys.readouterr().err
    assert not begun


def test_a_recording_that_no_twin_can_diagnose_is_refused_before_anything_is_explained(
    tmp_path, capsys, begun
):
    """Its band ends below the pistons' first order, that of the healthy recording does not."""
    content = sheet()
    point = content["recordings"][0]
    content["recordings"].append(
        point | {"file": "now.h5", "state": "unknown", "max_frequency_hz": 100.0}
    )
    write_case(tmp_path, content)
    write_hdf5(tmp_path / "now.h5", ripple())
    assert _diagnose(tmp_path) == 2
    assert "recording now: min_frequency_hz, max_frequency_hz: the band, 0 to 100 Hz" in (
        capsys.readouterr().err
    )
    assert not begun
