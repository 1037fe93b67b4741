"""What one pump costs: processor time and memory of each command, size of what it leaves."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryFile

import rippletwin
from measured_command import run_measured
from rippletwin.case.load import load_case

RIPPLETWIN = (sys.executable, "-m", "rippletwin")


def run_command(command: Sequence[str]) -> dict[str, float]:
    """Run it to its end on one thread: {"cpu_s", "wall_s", "peak_mb"}, its processes together.

    cpu_s is user and system time; peak_mb the resident memory of its largest process. Raises
    RuntimeError with what it printed where it fails.
    """
    threads = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
    with TemporaryFile() as printed:
        taken = run_measured(
            command, stdout=printed, stderr=subprocess.STDOUT, env={**os.environ, **threads}
        )
        if taken.returncode:
            printed.seek(0)
            told = printed.read().decode(errors="replace")[-2000:]
            raise RuntimeError(f"{' '.join(command)} ended with {taken.returncode}: {told}")
    return {
        "cpu_s": round(taken.cpu_s, 2),
        "wall_s": round(taken.wall_s, 2),
        "peak_mb": round(taken.peak_kib * 1024 / 1e6),
    }


def measure(case: Path, out: Path, repeats: int) -> dict:
    """Run `check`, `explain`, `diagnose` and `report` on a case, each `repeats` times.

    case : a folder with a healthy recording and one of another state, of which one is diagnosed.
    out : an empty folder. Returns {"jobs": {command: [costs of each run]}, "bytes": {...}}.
    """
    recordings = load_case(case).recordings
    asked = next(one for one in recordings if one.state != "healthy")
    explained, diagnosed, page = out / "explained", out / "diagnosed", out / "report.html"
    twin = explained / "twin.json"
    commands = {
        "check": ["check", case],
        "explain": ["explain", case, "--out", explained, "--processes", "1"],
        "diagnose": [
            "diagnose", case, "--twin", twin, "--recording", asked.label, "--out", diagnosed,
            "--no-figures",
        ],
        "report": [
            "report", case, "--explained", explained, "--diagnosed", diagnosed, "--out", page,
        ],
    }  # fmt: skip
    jobs = {}
    for name, arguments in commands.items():
        command = [*RIPPLETWIN, *map(str, arguments)]
        runs = []
        for _ in range(repeats):
            if name == "diagnose":  # answers that are kept would be told again
                shutil.rmtree(diagnosed, ignore_errors=True)
            runs.append(run_command(command))
        jobs[name] = runs
    healthy = [one.file for one in recordings if one.state == "healthy"]
    return {
        "jobs": jobs,
        "bytes": {
            "recordings of the healthy pump": sum(map(size, healthy)),
            "the recording that is diagnosed": size(asked.file),
            "verdict.json": size(explained / "verdict.json"),
            "twin.json": size(twin),
            "figures of explain": size(explained / "figures"),
            "diagnosis.json": size(diagnosed / "diagnosis.json"),
            "kept answers of diagnose": size(diagnosed / "kept"),
            "report.html": size(page),
            "shared: compiled code": compiled_size(),
            "shared: Python packages": size(Path(sysconfig.get_path("purelib"))),
        },
    }


def size(path: Path | str) -> int:
    """Bytes of a file, or of all files in a folder; a link counts as what it names."""
    path = Path(path)
    if path.is_dir():
        return sum(one.stat().st_size for one in path.rglob("*") if one.is_file())
    return path.stat().st_size


def compiled_size() -> int:
    """Bytes of the code that numba has compiled and keeps beside the library."""
    folder = Path(rippletwin.__file__).parent
    return sum(path.stat().st_size for path in folder.rglob("*.nb[ic]"))
