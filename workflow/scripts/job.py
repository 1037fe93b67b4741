"""What every script does first: its output goes to the job's log, progress to the terminal too."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Callable

from rippletwin.errors import InputError, describe_write_error


def open_log(snakemake) -> Callable[[str], None]:
    """Redirect this process's output to the job's log; returns report_progress(text).

    Bad input ends the job with its message alone, anything else with a traceback in the log.
    """
    terminal = sys.stderr
    log = open(snakemake.log[0], "w", buffering=1)
    sys.stdout = sys.stderr = log
    name = " ".join([snakemake.rule, *map(str, snakemake.wildcards)])

    def report_progress(text: str) -> None:
        print(text, file=log)
        print(f"{name}: {text}", file=terminal, flush=True)

    def fail(kind, error, trace):
        traceback.print_exception(kind, error, trace, file=log)
        told = error if issubclass(kind, InputError) else describe_write_error(error) or repr(error)
        print(f"{name}: {told}", file=terminal, flush=True)

    sys.excepthook = fail
    return report_progress
