"""The Kubernetes profile by dry run, and jobs whose results are in a store, on this machine.

No job has run on a Kubernetes.
"""

import importlib.util
import os
import re
import shutil
import subprocess
import sys
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest
import yaml
from snakemake.cli import get_argument_parser

from paths import ROOT
from small_run import EVERY_STAGE, OVERLAY, start, write_case

PROFILE = yaml.safe_load((ROOT / "profiles/kubernetes/config.yaml").read_text())
EXECUTOR, STORAGE = "snakemake_executor_plugin_kubernetes", "snakemake_storage_plugin_s3"
FOLDER_STORAGE = "snakemake_storage_plugin_fs"
OF_PLUGINS = ("executor", "default-storage-provider", "default-storage-prefix")


class EmptyStore(BaseHTTPRequestHandler):
    """An object store without a bucket: whatever it is asked for is not found."""

    def do_HEAD(self):
        self.send_error(404)

    do_GET = do_HEAD

    def log_message(self, *arguments):
        """Nothing is printed."""


@pytest.fixture
def empty_store():
    """Its URL."""
    with ThreadingHTTPServer(("127.0.0.1", 0), EmptyStore) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()
        thread.join()


def plan(folder, profile, *options, **environment):
    """The text of each job of a dry run of the smoke run with a profile."""
    (folder / "config.yaml").write_text(yaml.safe_dump(profile))
    command = [
        sys.executable, "-m", "snakemake", "--dry-run", "--workflow-profile", str(folder),
        "--configfile", "config/smoke.yaml", "--config", "results=results/kubernetes",
        *options,
    ]  # fmt: skip
    search = os.pathsep.join(filter(None, [str(ROOT / "src"), os.environ.get("PYTHONPATH")]))
    result = subprocess.run(
        command, cwd=ROOT, env={**os.environ, "PYTHONPATH": search, **environment},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    told = result.stdout + result.stderr
    assert result.returncode == 0, told[-3000:]
    return re.findall(r"^rule \w+:\n(?:    .*\n)+", told, re.M)


def files(job, kind):
    """The files of one kind that a job's text lists, as they are told."""
    listed = re.search(rf"^    {kind}: (.*)$", job, re.M)
    return listed[1].split(", ") if listed else []


def skip_without(*plugins):
    for plugin in plugins:
        if importlib.util.find_spec(plugin) is None:
            pytest.skip(f"without {plugin.replace('_', '-')}")


def without_plugins():
    """The profile's settings that need no plugin."""
    return {key: value for key, value in PROFILE.items() if key not in OF_PLUGINS}


def test_every_key_of_the_profile_is_an_option_of_snakemake():
    """Snakemake knows them without a plugin, so that none is read as something else."""
    known = {name for action in get_argument_parser()._actions for name in action.option_strings}
    assert {f"--{key}" for key in PROFILE} <= known


def test_every_job_states_its_memory(tmp_path):
    """Memory of each job, from its rule or from the profile; its cores are its threads, which a
    dry run tells where they are not one."""
    jobs = plan(tmp_path, without_plugins(), "--cores", "2")
    assert len(jobs) > 100
    memory = [int(re.search(r"^    resources: .*\bmem_mb=(\d+)", job, re.M)[1]) for job in jobs]
    assert min(memory) == PROFILE["default-resources"]["mem_mb"] and max(memory) == 4000
    threads = [re.search(r"^    threads: (\d+)$", job, re.M) for job in jobs]
    assert {int(stated[1]) for stated in threads if stated} == {2}


def test_results_go_to_the_store_and_sources_come_with_the_job(tmp_path, empty_store):
    """With executor and storage plugin the same jobs are planned. What a job makes goes to the
    store, and what it reads comes from there or is a file that Snakemake sends with a job: one
    that git has."""
    skip_without(EXECUTOR, STORAGE)
    here = plan(tmp_path, without_plugins())
    jobs = plan(
        tmp_path,
        PROFILE,
        SNAKEMAKE_STORAGE_S3_ENDPOINT_URL=empty_store,
        SNAKEMAKE_STORAGE_S3_ACCESS_KEY="key",
        SNAKEMAKE_STORAGE_S3_SECRET_KEY="secret",
    )
    assert sorted(job.split("\n")[0] for job in jobs) == sorted(job.split("\n")[0] for job in here)
    bucket = f"{PROFILE['default-storage-prefix']}/results/kubernetes/"
    sent = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True)
    tracked = set(sent.stdout.splitlines())
    for job in jobs:
        for kind in ("output", "log", "benchmark"):
            for file in files(job, kind):
                assert file.startswith(bucket) and file.endswith("(send to storage)"), job
        for file in files(job, "input"):
            stored = file.startswith(bucket) and file.endswith("(retrieve from storage)")
            assert stored or file in tracked, job


@pytest.mark.long
def test_every_stage_runs_with_its_results_in_a_store(tmp_path):
    """Ten jobs for which a folder is the store: each fetches what it reads and puts there what it
    made, and the working folder has no results."""
    skip_without(FOLDER_STORAGE)
    if shutil.which("rsync") is None:
        pytest.skip("without rsync, with which that plugin copies")
    write_case(tmp_path / "case")
    (tmp_path / "small.yaml").write_text(OVERLAY)
    store = tmp_path / "store"
    options = ("--default-storage-provider", "fs", "--default-storage-prefix", str(store))
    printed = tmp_path / "printed"
    with printed.open("w") as stream:
        run = start(tmp_path, EVERY_STAGE, *options, stdout=stream, stderr=subprocess.STDOUT)
        ended = run.wait()
    assert ended == 0, printed.read_text()[-3000:]
    assert "10 of 10 steps" in printed.read_text()
    for name in (*EVERY_STAGE, "out/explain/verdict.json", "out/diagnosis/diagnosis.json"):
        assert (store / name).exists(), name
    assert not (tmp_path / "out").exists()
