"""Coverage-guided fuzzing finds what is wrong, and finds nothing in the readers."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("atheris")
PROGRAM = Path(__file__).with_name("guided.py")
PLANTED = """
import sys
import atheris
import guided

def prepare(folder):
    path = folder / "planted"
    path.write_bytes(b"good")

    @atheris.instrument_func
    def read():
        data = path.read_bytes()
        if len(data) == 2 and data[0] == 82:
            if data[1] == 84:
                raise ValueError("planted")

    return path, read

guided.READERS["planted"] = prepare
sys.argv = ["guided", "planted", "--inputs", "100000", "--found", sys.argv[1]]
sys.exit(guided.main())
"""


@pytest.mark.long
def test_a_planted_fault_is_found(tmp_path):
    """Nested conditions on the length and both bytes: at random hardly one input in 10 million
    meets them, guided by the branches that are reached some ten thousand suffice. The input is
    kept."""
    path = f"{PROGRAM.parent}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"
    command = [sys.executable, "-c", PLANTED, str(tmp_path)]
    result = subprocess.run(command, env=os.environ | {"PYTHONPATH": path}, capture_output=True)
    assert result.returncode == 1
    (found,) = tmp_path.glob("planted-*")
    assert found.read_bytes() == b"RT"


@pytest.mark.long
def test_nothing_is_found_in_the_readers(tmp_path):
    """Every input is read or refused in words; RIPPLETWIN_FUZZ states how many each reader gets."""
    inputs = os.environ.get("RIPPLETWIN_FUZZ", "1000")
    command = [sys.executable, str(PROGRAM), "--inputs", inputs, "--found", str(tmp_path)]
    result = subprocess.run(command, capture_output=True, text=True, errors="replace")
    assert result.returncode == 0, result.stderr[-3000:]
    assert not list(tmp_path.iterdir())
