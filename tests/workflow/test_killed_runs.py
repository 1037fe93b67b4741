"""A run that is killed at any moment and started again ends as if nothing had happened."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from paths import ROOT

SMALL = """\
results: out
datasets: [CFD-MOC-P+, experimental]
seeds: 1
samples_per_class: {time: 16, image: 10, randomised: 2}
architectures: [cnn1d_341_100]
training: {plain: {max_epochs: 2}}
"""
COMMAND = (sys.executable, "-m", "snakemake", "--cores", "2", "--quiet", "all")
LEAST, MEAN = 4.0, 40.0  # s from a start to the kill
MAX_RUNS = 400
RESULTS = ("*.csv", "explain/*.json", "diagnosis/*.json", "calibration/*.json")


def copy_repository(folder: Path) -> Path:
    """What a run needs, in `folder`, with a small configuration."""
    for name in ("workflow", "config", "src", "resources", "profiles"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "Snakefile", folder)
    (folder / "small.yaml").write_text(SMALL)
    return folder


def run(folder: Path, seconds: float | None = None) -> bool:
    """Whether the run ended by itself with success; else its whole process group was killed.

    Whatever it printed is in the message of the error if it ended with a failure.
    """
    overlay = ("--configfile", "config/smoke.yaml", "small.yaml")
    environment = os.environ | {"PYTHONPATH": str(folder / "src")}
    with (folder / "printed").open("w") as printed:
        process = subprocess.Popen(
            [*COMMAND, *overlay], cwd=folder, env=environment, start_new_session=True,
            stdout=printed, stderr=subprocess.STDOUT,
        )  # fmt: skip
        try:
            code = process.wait(seconds)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            subprocess.run(
                [*COMMAND, *overlay, "--unlock"], cwd=folder, env=environment, check=True,
                capture_output=True,
            )  # fmt: skip
            return False
    assert code == 0, (folder / "printed").read_text()[-3000:]
    return True


def read_everything(results: Path) -> None:
    """Read each finished table and JSON file; a torn one raises."""
    for path in results.rglob("*.json"):
        if not any(part.startswith(".") for part in path.relative_to(results).parts):
            json.loads(path.read_text())
    for path in results.glob("*.csv"):
        pd.read_csv(path)


def final_results(results: Path) -> dict[str, bytes]:
    """The contents of tables, verdict, twin and calibration, by name."""
    found = {
        str(path.relative_to(results)): path.read_bytes()
        for pattern in RESULTS
        for path in results.glob(pattern)
    }
    assert {"accuracy.csv", "explain/verdict.json", "explain/twin.json"} <= set(found)
    return found


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory) -> dict[str, bytes]:
    folder = copy_repository(tmp_path_factory.mktemp("undisturbed") / "run")
    assert run(folder)
    return final_results(folder / "out")


@pytest.mark.long
@pytest.mark.parametrize("kills", [3, 100])
def test_a_killed_run_ends_as_an_undisturbed_one(undisturbed, tmp_path, kills):
    """SIGKILL to the whole process group at random moments: no finished file is torn, and once the
    run may end, tables, verdict and twin have the bytes of a run that nobody disturbed. A run that
    has ended is begun anew until so many kills have hit."""
    rng, folder, killed = np.random.default_rng(), None, 0
    for attempt in range(MAX_RUNS):
        if folder is None:
            folder = copy_repository(tmp_path / str(attempt))
        wait = LEAST + rng.exponential(MEAN) if killed < kills else None
        if not run(folder, wait):
            killed += 1
            read_everything(folder / "out")
            continue
        assert final_results(folder / "out") == undisturbed, folder
        shutil.rmtree(folder)
        folder = None
        if killed >= kills:
            return
    pytest.fail(f"{killed} kills in {MAX_RUNS} runs")


def test_a_second_run_in_a_folder_is_refused(tmp_path):
    """While one run holds a folder another ends at once with a clear word; the first goes on."""
    folder = copy_repository(tmp_path / "run")
    overlay = ("--configfile", "config/smoke.yaml", "small.yaml")
    environment = os.environ | {"PYTHONPATH": str(folder / "src")}
    first = subprocess.Popen(
        [*COMMAND, *overlay], cwd=folder, env=environment, start_new_session=True,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        locks = folder / ".snakemake" / "locks"
        while not (locks.is_dir() and any(locks.iterdir())):
            assert first.poll() is None
            time.sleep(0.1)
        # without --quiet, which hides what is wrong
        second = subprocess.run(
            [*COMMAND[:-2], *overlay], cwd=folder, env=environment, capture_output=True, text=True,
            check=False,
        )  # fmt: skip
        assert second.returncode != 0
        assert "cannot be locked" in second.stderr + second.stdout
        assert first.poll() is None
    finally:
        os.killpg(first.pid, signal.SIGKILL)
        first.wait()
