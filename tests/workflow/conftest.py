"""A finished run of the workflow whose scripts only make empty outputs."""

import shutil
import subprocess
from pathlib import Path

import pytest

from workflow_copy import make, snakemake


@pytest.fixture(scope="session")
def finished(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("finished") / "workflow"
    make(folder)
    result = snakemake(folder)
    assert result.returncode == 0, result.stderr
    return folder


@pytest.fixture
def workflow(finished, tmp_path) -> Path:
    """A copy of the finished run to edit."""
    folder = tmp_path / "workflow"
    subprocess.run(["cp", "-a", finished, folder], check=True)
    yield folder
    shutil.rmtree(folder)
