"""rippletwin explain CASE: say what physics the twin lacks, and where."""

from __future__ import annotations

import json
import os
from pathlib import Path

import click

from rippletwin.cli import options
from rippletwin.cli.exit_codes import found_code
from rippletwin.cli.progress import progress_bars, warn
from rippletwin.errors import InputError

FOUND = ("missing", "named", "ambiguous", "unexplained", "bad_data", "warning")
"""What --fail-on takes: a verdict; `missing`, any verdict by which physics is missing; `warning`,
of the data sheet."""


@click.command("explain", short_help="say what physics the twin lacks, and where")
@options.case
@options.out("Folder for verdict.json, twin.json, figures.")
@click.option(
    "--json",
    "--json-only",
    "as_json",
    is_flag=True,
    help="Print the verdict as JSON and nothing else.",
)
@options.effects("Also try the effect that a Python file defines as EFFECT, again for more.")
@options.frequency("--min-frequency", "Use nothing below it.")
@options.frequency("--max-frequency", "Use nothing above it.")
@options.processes("fit")
@options.no_figures
@click.option(
    "--bootstrap",
    type=int,
    default=0,
    metavar="N",
    help="Where something is named, draw N recordings without it and fit them with the whole "
    "library: the evidence that chance adds is the threshold (at least 10; each takes a good part "
    "of the first search).",
)
@options.fail_on(FOUND, "This is the verdict, or physics is missing.")
def command(
    case: Path,
    out: str,
    as_json: bool,
    effects: tuple[str, ...],
    min_frequency: float | None,
    max_frequency: float | None,
    processes: int,
    no_figures: bool,
    bootstrap: int,
    fail_on: tuple[str, ...],
) -> int:
    """Say what physics the twin of the folder CASE lacks, and where; write verdict.json."""
    # One thread a process: the matrices are small, and the processes share the cores.
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    from rippletwin.case.load import load_case
    from rippletwin.explanation.checks.bootstrap import MIN_DRAWS
    from rippletwin.explanation.explain import explain
    from rippletwin.explanation.verdict.verdict_file import write_verdict
    from rippletwin.twin.effects.library import add_effects

    if bootstrap and bootstrap < MIN_DRAWS:
        raise InputError(
            "command line",
            "--bootstrap",
            f"{bootstrap} draws tell no threshold",
            f"Give at least {MIN_DRAWS}, or leave it out",
        )
    read = load_case(case, states={"healthy"}, band_hz=(min_frequency, max_frequency))
    add_effects(effects, read.rig)
    warn(read.warnings)
    with progress_bars(as_json) as progress:
        explanation = explain(read, processes, progress, bootstrap)
    result = write_verdict(explanation, out)
    from rippletwin.figures.explanation import draw, remove_figures  # takes a second

    if no_figures:
        remove_figures(out)
    else:
        draw(explanation, out, processes=processes)
    print(json.dumps(result) if as_json else result["sentence"])
    found = [result["verdict"]]
    found += ["missing"] * (result["verdict"] in ("named", "ambiguous", "unexplained"))
    return found_code([*found, *(["warning"] if read.warnings else [])], fail_on)
