"""rippletwin diagnose: the exit code that --fail-on asks for."""

import json
from types import SimpleNamespace

import pytest

from case_folders import sheet, write_case
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
    monkeypatch.setattr(twin_of, lambda file, out, n, case, *rest: SimpleNamespace(rig=case.rig))
    command = ["diagnose", str(tmp_path), "--out", str(tmp_path / "out"), "--no-figures"]
    command += ["--recording", "healthy_0", *(f"--fail-on={word}" for word in words)]
    assert main(command) == code
    assert capsys.readouterr().out == f"It is {state}.\n"
    written = json.loads((tmp_path / "out/diagnosis.json").read_text())
    assert [each["state"] for each in written["recordings"]] == [state]
