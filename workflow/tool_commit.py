"""What git says of the tool that a trial tries."""

from __future__ import annotations

import subprocess
from pathlib import Path

from snakemake.exceptions import WorkflowError

TOOL = "src/rippletwin"
TRIAL = "src", "workflow"  # with it what draws, records, confines and scores


def tool_commit(root: Path) -> str:
    """Hash of the tool's source in the commit at `root`: nobody can choose the cases it leads to.

    Raises WorkflowError where `root` is no git checkout.
    """
    return _git(root, "rev-parse", f"HEAD:{TOOL}")


def not_committed(root: Path) -> bool:
    """Whether the tool that runs, or what draws and scores its cases, differs from that commit,
    which the trial's page then says."""
    return _git(root, "status", "--porcelain", *TRIAL) != ""


def _git(root: Path, *arguments: str) -> str:
    command = ["git", "-C", str(root), *arguments]
    try:
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError) as error:
        raise WorkflowError(
            "a trial's cases follow from the tool's commit; run it in a git checkout"
        ) from error
