"""The command line: options are checked before anything is fitted, and it ends quietly."""

import json
import os
import signal
import subprocess
import sys
import tempfile
from contextlib import contextmanager
from pathlib import Path

import pytest

from case_folders import sheet, spoilt, write_case
from paths import ROOT
from rippletwin.cli import main
from rippletwin.cli.program import COMMANDS
from rippletwin.cli.progress import progress_bars
from rippletwin.errors import InputError

ENVIRONMENT = os.environ | {"PYTHONPATH": str(ROOT / "src"), "OMP_NUM_THREADS": "1"}

OPTIONS = {
    "negative frequency": ("calibrate", ["--max-frequency", "-5"], "--max-frequency", "-5"),
    "no frequency": ("calibrate", ["--max-frequency", "nan"], "--max-frequency", "nan"),
    "infinite frequency": ("calibrate", ["--max-frequency", "inf"], "--max-frequency", "inf"),
    "no processes": ("explain", ["--processes", "0"], "--processes", "0 is no number of processes"),
    "negative processes": ("explain", ["--processes", "-1"], "--processes", "-1 is no number"),
    "too many processes": ("explain", ["--processes", "99999"], "--processes", "99999"),
    "too few draws": ("explain", ["--bootstrap", "3"], "--bootstrap", "3 draws"),
    "a word for a number": ("explain", ["--processes", "two"], "--processes", "two is no number"),
    "no such command": ("explian", [], "command", "Did you mean 'explain'? See"),
    "no such option": ("explain", ["--procesess", "2"], "--procesess", "explain --help"),
    "no such finding": ("explain", ["--fail-on", "anything"], "--fail-on", "anything"),
    "no folder": ("explain", ["--out", ""], "--out", "no folder is named"),
    "blanks": ("calibrate", ["--out", "  "], "--out", "no folder is named"),
    "a file": ("calibrate", ["--out", "{file}"], "--out", "is a file"),
    "below a file": ("explain", ["--out", "{file}/deeper/results"], "--out", "is a file"),
    "a name too long": ("explain", ["--out", "x" * 5000], "--out", "cannot be opened"),
}


def known_pump(content):
    """Give the sheet a pump of its own, so that no warning is told."""
    content["pump"] |= {"piston_diameter": 0.017, "pitch_radius": 0.0335, "swash_angle_deg": 17.0}


@pytest.mark.parametrize("name", OPTIONS)
def test_option_that_makes_no_sense(tmp_path, capsys, name):
    """Refused with exit code 2 before the case is even read: there is none in this folder."""
    command, options, option, words = OPTIONS[name]
    (tmp_path / "file").touch()
    options = [text.format(file=tmp_path / "file") for text in options]
    if "--out" not in options:
        options += ["--out", str(tmp_path / "out")]
    assert main([command, str(tmp_path), *options]) == 2
    told = capsys.readouterr()
    assert told.out == "" and len(told.err.splitlines()) == 1
    assert option in told.err and words in told.err
    assert not (tmp_path / "out").exists()


@contextmanager
def another_user():
    """Not root, who may write everywhere."""
    root = os.geteuid() == 0
    if root:
        os.seteuid(65534)
    try:
        yield
    finally:
        if root:
            os.seteuid(0)


SHEET = "--pistons 9 --viscosity 32 --segment 5950,19.7,2.5 --sensor p1,420 --no-ask".split()
POINT = "--speed 1000 --pressure 95".split()
READ_ONLY = {
    "new": ["new", "{}", *SHEET],
    "calibrate": ["calibrate", "{}", "--out", "{}/out"],
    "explain": ["explain", "{}", "--out", "{}/out"],
    "diagnose": ["diagnose", "{}", "--out", "{}/out"],
    "simulate": ["simulate", "healthy", "--twin", "{}/t.json", *POINT, "--out", "{}/run.csv"],
    "export": ["export", "{}", "--out", "{}/out"],
    "report": ["report", "{}", "--out", "{}/report.html"],
}
"""Every command that writes, into the folder {}."""


@pytest.mark.parametrize("name", [c for c in COMMANDS if c not in ("check", "completion")])
def test_folder_that_may_not_be_written(capsys, name):
    """Results that could not be written are told before anything is read or fitted: a line, exit
    code 2, and nothing is left there."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder).chmod(0o555)
        with another_user():
            assert main([word.format(folder) for word in READ_ONLY[name]]) == 2
        assert not list(Path(folder).iterdir())
    (said,) = capsys.readouterr().err.splitlines()
    assert said.startswith("rippletwin: ") and folder in said
    assert "not allowed to write" in said or "cannot be written (Permission denied)" in said


@pytest.mark.parametrize("band", [["--max-frequency", "10"], ["--min-frequency", "4990"]])
def test_a_band_without_a_piston_harmonic(tmp_path, capsys, band):
    """Of a pump at 150 Hz nothing is left below 10 Hz, nor between 4990 Hz and the usual end of
    5 kHz; told before the fit."""
    write_case(tmp_path, sheet())
    assert main(["calibrate", str(tmp_path), "--out", str(tmp_path / "out"), *band]) == 2
    told = capsys.readouterr()
    assert "no frequency of the recording is between them" in told.err and told.out == ""


def test_the_band_of_the_command_line_is_what_calibrate_fits(tmp_path, monkeypatch):
    """Of harmonics 150 Hz apart those between 400 and 1000 Hz reach the fit, and no other."""
    write_case(tmp_path, sheet())
    fitted = []

    def stop(twin, observations, **options):
        fitted.extend(observations)
        raise InputError("stub", "fit", "not made", "None")

    monkeypatch.setattr("rippletwin.calibration.calibrate_case.calibrate", stop)
    band = ["--min-frequency", "400", "--max-frequency", "1000"]
    assert main(["calibrate", str(tmp_path), "--out", str(tmp_path / "out"), *band]) == 2
    assert fitted[0].orders.tolist() == [27, 36, 45, 54]


def test_every_fault_is_a_line(tmp_path, capsys):
    """Three mistakes in a sheet are three lines on standard error, and exit code 2."""

    def spoil(content):
        content["fluid"]["density"] = 0.87
        content["fluid"]["kinematic_viscosity"] = 32
        content["recordings"][0]["state"] = "worn"

    spoilt(tmp_path, spoil)
    assert main(["check", str(tmp_path / "rig.yaml")]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 3 and all(line.startswith("rippletwin: ") for line in lines)


def test_warnings_are_told(tmp_path, capsys):
    """A value that is possible but unusual is a line on standard error; the case is read."""
    spoilt(tmp_path, lambda c: c["line"]["segments"][0].update(wave_speed=150))
    assert main(["check", str(tmp_path)]) == 0
    told = capsys.readouterr()
    assert "warning: line.segments[0].wave_speed" in told.err
    assert "revolutions" in told.out


def test_interrupt_ends_without_a_traceback(tmp_path, capsys, monkeypatch):
    """Ctrl-C is exit code 130 and nothing is printed."""

    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("rippletwin.case.load.load_case", interrupted)
    assert main(["check", str(tmp_path)]) == 130
    assert capsys.readouterr().err == ""


FITS = """
import os, signal, sys, time
signal.signal(signal.SIGINT, signal.default_int_handler)  # a suite in the background ignores it
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
import rippletwin.explanation.explain as module

def work(_):
    os.write(1, b"ready" + bytes([10]))  # in one piece: two processes write
    time.sleep(100)

def slow(*_):
    with ProcessPoolExecutor(2, get_context("fork")) as pool:
        list(pool.map(work, range(2)))

module.explain = slow
from rippletwin.cli import main
sys.exit(main(["explain", sys.argv[1], "--out", sys.argv[1] + "/out"]))
"""


def test_interrupt_ends_the_fitting_processes_too(tmp_path):
    """Ctrl-C reaches every process of the terminal; none of them prints a traceback."""
    spoilt(tmp_path, known_pump)
    run = subprocess.Popen(
        [sys.executable, "-c", FITS, str(tmp_path)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=ENVIRONMENT,
        start_new_session=True,
    )
    assert [run.stdout.readline() for _ in range(2)] == ["ready\n", "ready\n"]
    os.killpg(run.pid, signal.SIGINT)
    _, told = run.communicate(timeout=60)
    assert (run.returncode, told) == (130, "")


def test_reader_that_leaves_ends_without_a_traceback(tmp_path):
    """rippletwin check CASE | head -1"""
    spoilt(tmp_path, known_pump)
    run = subprocess.Popen(
        [sys.executable, "-m", "rippletwin", "check", str(tmp_path)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=ENVIRONMENT,
    )
    assert "segment" in run.stdout.readline()
    run.stdout.close()
    told = run.stderr.read()
    assert (run.wait(timeout=60), told) == (141, "")


def test_a_terminal_without_the_letters_of_a_label(tmp_path):
    """An ASCII terminal gets their codes, and no traceback."""

    def cyrillic(content):
        content["recordings"][0]["label"] = "насос"

    spoilt(tmp_path, cyrillic)
    command = [sys.executable, "-m", "rippletwin", "export", str(tmp_path), "--out"]
    environment = ENVIRONMENT | {"PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"}
    run = subprocess.run(
        [*command, str(tmp_path / "out")], capture_output=True, text=True, env=environment
    )
    assert run.returncode == 0 and "\\u043d" in run.stdout, run.stderr


def test_module_is_the_command(tmp_path):
    """python -m rippletwin takes the same command line."""
    command = [sys.executable, "-m", "rippletwin", "check", str(tmp_path / "nowhere")]
    run = subprocess.run(command, capture_output=True, text=True, env=ENVIRONMENT)
    assert run.returncode == 2 and "there is no such folder" in run.stderr


def test_json_is_all_that_is_printed(tmp_path, capsys):
    """check --json: one document with the numbers that the words state; the rig turns 16.67 times
    a second, of which the recording's one second has 15 whole revolutions after the first mark."""
    write_case(tmp_path, sheet())
    assert main(["check", str(tmp_path), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [s["name"] for s in found["sensors"]] == ["p1", "p2"]
    recording = found["recordings"][0]
    assert recording["speed_rpm"] == pytest.approx(1000, abs=0.1)
    assert recording["sensors"][0]["piston_harmonics"][0] == 5
    assert recording["sensors"][0]["noise_pa"] == pytest.approx(1e3, rel=0.1)


def test_fail_on_a_warning(tmp_path, capsys):
    """Exit code 3 only where a warning is told and --fail-on names it."""
    spoilt(tmp_path, known_pump)
    assert main(["check", str(tmp_path), "--fail-on", "warning"]) == 0
    spoilt(tmp_path, lambda c: c["line"]["segments"][0].update(wave_speed=150))
    assert main(["check", str(tmp_path)]) == 0
    assert main(["check", str(tmp_path), "--fail-on", "warning"]) == 3


def test_json_of_a_calibration(tmp_path, capsys):
    """calibrate --json prints one document: misfits, parameters and warnings."""
    write_case(tmp_path, sheet())
    assert main(["calibrate", str(tmp_path), "--out", str(tmp_path / "out"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["fit"]["after"]["relative"] < found["fit"]["before"]["relative"]
    assert "length[1]" in {row["name"] for row in found["parameters"]}


def test_every_command_prints_json_and_helps(capsys):
    """No command is without --json, and the list of commands has a line for each."""
    assert main(["--help"]) == 0
    listed = capsys.readouterr().out
    for name in COMMANDS:
        assert f"\n  {name} " in listed
        assert main([name, "--help"]) == 0
        assert "--json" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "expected"),
    [("rippletwin expl", "explain"), ("rippletwin explain --boot", "--bootstrap")],
)
def test_completion_in_a_shell(tmp_path, words, expected):
    """bash, with the printed script sourced, completes a command and an option."""
    program = tmp_path / "rippletwin"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m rippletwin "$@"\n')
    program.chmod(0o755)
    script = f"""
        source <(rippletwin completion bash)
        COMP_WORDS=({words}); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1))
        _rippletwin_completion rippletwin; echo "${{COMPREPLY[@]}}"
    """
    run = subprocess.run(
        ["bash", "-c", script],
        capture_output=True,
        text=True,
        env=ENVIRONMENT | {"PATH": f"{tmp_path}:{os.environ['PATH']}"},
    )
    assert run.stdout.split() == [expected], run.stderr


def test_help_imports_no_mathematics():
    """--help answers at once: of what takes long to import it needs nothing."""
    script = (
        "import sys; from rippletwin.cli import main; main(['--help'])\n"
        "print({'numpy', 'scipy', 'pandas', 'torch', 'numba'} & set(sys.modules))"
    )
    command = [sys.executable, "-c", script]
    run = subprocess.run(command, capture_output=True, text=True, env=ENVIRONMENT)
    assert run.stdout.splitlines()[-1] == "set()", run.stderr


def test_recordings_of_another_point_are_told(tmp_path, capsys):
    """Of two unknown recordings the workflow classifies one: check names the other one."""

    def spoil(content):
        first = content["recordings"][0]
        content["recordings"] = [
            {**first, "label": "as it was", "state": "unknown"},
            {**first, "label": "loaded", "state": "unknown", "load_pressure": 9.9e6},
        ]

    spoilt(tmp_path, spoil)
    assert main(["check", str(tmp_path), "--json"]) == 0
    advice = json.loads(capsys.readouterr().out)["advice"]
    assert [line for line in advice if "Outside it: loaded." in line]


def test_no_bar_is_drawn_where_nobody_looks(capsys):
    """Standard error that is no terminal, as in a log, gets no states of a progress bar."""
    with progress_bars() as progress:
        for done in range(3):
            progress("fits", done, 2)
    assert capsys.readouterr() == ("", "")
