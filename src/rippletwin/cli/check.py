"""rippletwin check CASE: read a case and say what is in it."""

from __future__ import annotations

import json
from pathlib import Path

import click

from rippletwin.cli import options
from rippletwin.cli.exit_codes import found_code
from rippletwin.cli.progress import progress_bars, warn


@click.command("check", short_help="read a case and say what is in it")
@options.case
@options.fail_on(("warning",), "A value is unusual, or another warning is told.")
@options.json_output
def command(case: Path, fail_on: tuple[str, ...], as_json: bool) -> int:
    """Read the folder CASE with a rig.yaml and say what is in it."""
    from threadpoolctl import threadpool_limits

    from rippletwin.case.load import load_case
    from rippletwin.spectra import case_summary

    read = load_case(case)
    warn(read.warnings)
    summary = case_summary.summarise_rig(read)
    if not as_json:
        print("\n".join(case_summary.rig_in_words(summary)), flush=True)
    summary["recordings"] = []
    # one thread: the matrices are small, and threads only wait for each other
    with threadpool_limits(1), progress_bars(as_json, passing=True) as progress:
        for recording in read.recordings:
            found = case_summary.summarise_recording(recording, read.rig, progress)
            summary["recordings"].append(found)
            if not as_json:
                print("\n".join(case_summary.recording_in_words(found)), flush=True)
    if as_json:
        print(json.dumps(summary))
    return found_code(["warning"] if read.warnings else [], fail_on)
