"""A run that is killed at any moment and started again ends as if nothing had happened."""

import os
import shutil
import signal
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from run_results import final_results, read_everything
from small_run import EVERY_STAGE, OVERLAY, start, write_case

SMOKE = """\
results: out
datasets: [CFD-MOC-P+, experimental]
seeds: 1
samples_per_class: {time: 16, image: 10, randomised: 2}
architectures: [cnn1d_341_100]
training: {plain: {max_epochs: 2}}
"""
POLL = 0.02  # s
# Snakemake's own hidden file in an output folder is no part of the store
pytestmark = pytest.mark.filterwarnings("ignore:.*snakemake_timestamp")


@dataclass(frozen=True)
class Experiment:
    """What is run, and how often it is killed."""

    overlay: str
    state: str | None  # of the second recording; None where the run makes the recordings itself
    targets: tuple[str, ...]
    runs: int
    kills: int  # in each run

    @property
    def scored(self) -> bool:
        """Whether networks are trained and scored."""
        return self.state != "unknown"


# Without a recording of a known fault no network is trained; the long experiment trains some.
FAST = Experiment(OVERLAY, "unknown", EVERY_STAGE, 1, 3)
LONG = Experiment(SMOKE, None, ("all",), 5, 20)


def make(folder: Path, experiment: Experiment) -> Path:
    """A folder in which nothing has run yet."""
    folder.mkdir()
    (folder / "small.yaml").write_text(experiment.overlay)
    if experiment.state:
        write_case(folder / "case", experiment.state)
    return folder


def run(folder: Path, experiment: Experiment, moment: tuple[int, float] | None = None) -> bool:
    """Whether the run was killed; it ends with success where it is not.

    moment : (jobs that have ended in this folder, s after that): when SIGKILL goes to the whole
        process group; None for never.
    """
    with (folder / "printed").open("w") as printed:
        process = start(folder, experiment.targets, stdout=printed, stderr=subprocess.STDOUT)
        while moment is not None and process.poll() is None and ended(folder) < moment[0]:
            time.sleep(POLL)
        try:
            code = process.wait(None if moment is None else moment[1])
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            # what `snakemake --unlock` does, without planning the whole run
            shutil.rmtree(folder / ".snakemake" / "locks", ignore_errors=True)
            return True
    assert code == 0, (folder / "printed").read_text()[-3000:]
    return False


def benchmarks(folder: Path) -> list[Path]:
    """A file for each job that has ended."""
    return list((folder / "out" / "benchmarks").rglob("*.tsv"))


def ended(folder: Path) -> int:
    return len(benchmarks(folder))


class Undisturbed:
    """A run that nobody kills: its results, and when each of its jobs ended."""

    def __init__(self, folder: Path, experiment: Experiment):
        began = time.time()
        assert not run(make(folder, experiment), experiment)
        self.seconds = time.time() - began
        self.ends = sorted(path.stat().st_mtime - began for path in benchmarks(folder))
        read_everything(folder / "out")
        self.results = final_results(folder / "out", experiment.scored)

    def moment(self, fraction: float) -> tuple[int, float]:
        """(jobs that had ended, s after the last of them) at this fraction of the run."""
        time_ = fraction * self.seconds
        count = int(np.searchsorted(self.ends, time_))
        return count, time_ - (self.ends[count - 1] if count else 0.0)


@pytest.mark.parametrize(
    "experiment", [FAST, pytest.param(LONG, marks=pytest.mark.long)], ids=["3", "100"]
)
def test_a_killed_run_ends_as_an_undisturbed_one(tmp_path, experiment):
    """SIGKILL to the whole process group at moments that are uniform over the course of the run:
    after each no file that has its final name is torn, and once the run may end, tables, verdict,
    twin, diagnosis and stores have the bytes of a run that nobody disturbed. A moment that comes
    after the end is drawn again, in a new folder."""
    undisturbed = Undisturbed(tmp_path / "undisturbed", experiment)
    seed = int.from_bytes(os.urandom(4), "big")
    print(f"seed {seed}, {undisturbed.seconds:.0f} s undisturbed")
    rng, killed, attempt = np.random.default_rng(seed), 0, 0
    while killed < experiment.runs * experiment.kills:
        folder = make(tmp_path / str(attempt), experiment)
        attempt += 1
        assert attempt <= 3 * experiment.runs, f"{killed} kills in {attempt} runs"
        for fraction in sorted(rng.uniform(size=experiment.kills)):
            moment = undisturbed.moment(fraction)
            if not run(folder, experiment, moment):
                break
            print(f"killed {moment[1]:.2f} s after {moment[0]} jobs")
            killed += 1
            read_everything(folder / "out")
        run(folder, experiment)
        read_everything(folder / "out")
        results = final_results(folder / "out", experiment.scored)
        assert set(results) == set(undisturbed.results), folder
        differing = [name for name in results if results[name] != undisturbed.results[name]]
        assert not differing, (folder, differing)
        shutil.rmtree(folder)


def test_a_second_run_in_a_folder_is_refused(tmp_path):
    """While one run holds a folder another ends at once with a clear word; the first goes on."""
    folder = make(tmp_path / "run", FAST)
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    first = start(folder, FAST.targets, **quiet)
    try:
        locks = folder / ".snakemake" / "locks"
        while not (locks.is_dir() and any(locks.iterdir())):
            assert first.poll() is None
            time.sleep(0.1)
        both = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
        second = start(folder, FAST.targets, **both)
        told, _ = second.communicate()
        assert second.returncode != 0
        assert "cannot be locked" in told
        assert first.poll() is None
    finally:
        os.killpg(first.pid, signal.SIGKILL)
        first.wait()
