"""Time and memory of a command, as the kernel counts them for its process and its children."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass

RSS_PER_KIB = 1024 if sys.platform == "darwin" else 1  # units of ru_maxrss


@dataclass(frozen=True)
class Taken:
    """Times in s; the peak is the resident memory of the largest process, in KiB."""

    returncode: int
    wall_s: float
    cpu_s: float  # user and system
    peak_kib: float


def run_measured(command: Sequence[str], **options) -> Taken:
    """Run a command to its end; `options` are those of `subprocess.Popen`."""
    began = time.monotonic()
    process = subprocess.Popen(command, **options)
    _, status, usage = os.wait4(process.pid, 0)
    wall = time.monotonic() - began
    process.returncode = os.waitstatus_to_exitcode(status)
    return Taken(
        process.returncode,
        wall,
        usage.ru_utime + usage.ru_stime,
        usage.ru_maxrss / RSS_PER_KIB,
    )
