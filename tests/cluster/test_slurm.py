"""The Slurm profile on a real Slurm of one node, which the tests start and stop."""

import importlib.util
import subprocess
import time

import pytest

from one_node_slurm import NODE, OneNodeSlurm, Unavailable
from small_run import EVERY_STAGE, OVERLAY, start, write_case

PLUGIN = "snakemake_executor_plugin_slurm"
OPTIONS = (
    "--slurm-no-account",
    "--slurm-status-command", "squeue",
    "--slurm-init-seconds-before-status-checks", "5",
    "--latency-wait", "5",
)  # fmt: skip
CALIBRATE = ("out/calibration/twin.json",)  # one job
PROPAGATE = ("out/propagated/calibrated/H.zarr",)  # four jobs
TIMEOUT = 300.0  # s

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def slurm(tmp_path_factory):
    if importlib.util.find_spec(PLUGIN) is None:
        pytest.skip("without snakemake-executor-plugin-slurm")
    try:
        cluster = OneNodeSlurm(tmp_path_factory.mktemp("slurm"))
    except Unavailable as reason:
        pytest.skip(f"no Slurm: {reason}")
    yield cluster
    cluster.stop()


@pytest.fixture
def folder(tmp_path):
    """A small case with its configuration; nothing has run."""
    write_case(tmp_path / "case")
    (tmp_path / "small.yaml").write_text(OVERLAY)
    return tmp_path


class Run:
    """A run of the workflow whose jobs Slurm runs; it is killed where a test leaves it early."""

    def __init__(self, slurm, folder, targets, *options):
        self.printed = folder / "printed"
        with self.printed.open("w") as printed:
            self.process = start(
                folder, targets, *OPTIONS, *options, profile="slurm", environment=slurm.environment,
                stdout=printed, stderr=subprocess.STDOUT,
            )  # fmt: skip

    def __enter__(self):
        return self

    def __exit__(self, *error):
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()

    def wait_for(self, what):
        """What `what` returns once it is true, while the run goes on."""
        end = time.monotonic() + TIMEOUT
        while not (found := what()):
            assert self.process.poll() is None and time.monotonic() < end, self.told()
            time.sleep(0.2)
        return found

    def told(self) -> str:
        return self.printed.read_text()

    def end(self) -> str:
        """What was printed by the run, which must end with success."""
        assert self.process.wait(TIMEOUT) == 0, self.told()[-3000:]
        return self.told()


def test_every_stage_runs_through_sbatch(slurm, folder):
    """Each of the ten jobs is a job of Slurm that completed, and verdict and diagnosis have the
    bytes of a run without Slurm."""
    before = set(slurm.jobs("completed"))
    with Run(slurm, folder, EVERY_STAGE) as run:
        told = run.end()
    assert "10 of 10 steps" in told
    assert len(set(slurm.jobs("completed")) - before) == 10
    files = ("explain/verdict.json", "diagnosis/diagnosis.json", "accuracy.csv")
    by_slurm = [(folder / "out" / name).read_bytes() for name in files]
    (folder / "out").rename(folder / "by_slurm")
    here = start(folder, EVERY_STAGE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    assert here.wait() == 0
    assert by_slurm == [(folder / "out" / name).read_bytes() for name in files]


def test_a_killed_job_is_submitted_again(slurm, folder):
    """Slurm kills the processes of a running job: Snakemake tells, submits the job once more, and
    the run ends with success."""
    with Run(slurm, folder, CALIBRATE) as run:
        [job] = run.wait_for(lambda: slurm.jobs("running"))
        run.wait_for((folder / "out" / "logs" / "calibrate.log").exists)
        slurm.ask("scancel", "--signal=KILL", "--full", job)
        told = run.end()
    assert "Trying to restart job" in told
    assert (folder / "out" / "calibration" / "twin.json").exists()


def test_a_drained_node_ends_its_job_and_begins_no_other(slurm, folder):
    """While the node is drained the job on it ends and those after it wait; once the node is back
    they run, and nothing is lost."""
    with Run(slurm, folder, PROPAGATE) as run:
        run.wait_for(lambda: slurm.jobs("running"))
        slurm.ask("scontrol", "update", f"nodename={NODE}", "state=drain", "reason=test")
        try:
            run.wait_for(lambda: slurm.node_state() == "drained")
            run.wait_for(lambda: slurm.jobs("pending"))
            time.sleep(5.0)  # several rounds of the scheduler
            assert not slurm.jobs("running")
            assert slurm.jobs("pending")
        finally:
            slurm.ask("scontrol", "update", f"nodename={NODE}", "state=resume")
        told = run.end()
    assert "Trying to restart job" not in told
    assert (folder / "out" / "propagated" / "calibrated" / "H.zarr").is_dir()
