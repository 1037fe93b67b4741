"""rippletwin report CASE: one page of HTML with what is known of a case."""

from __future__ import annotations

import json
from pathlib import Path

import click

from rippletwin.cli import options
from rippletwin.cli.exit_codes import found_code
from rippletwin.cli.progress import warn


@click.command("report", short_help="write one page that shows a case and its results")
@options.case
@options.out_file("The page, one HTML file that needs nothing beside it.")
@click.option(
    "--explained",
    metavar="DIR",
    help="The folder that explain wrote; by default CASE/explained, or the folder of the diagnosis "
    "where only that holds a verdict.",
)
@click.option(
    "--diagnosed",
    metavar="DIR",
    help="The folder that diagnose wrote; by default CASE/diagnosed.",
)
@options.json_output
@options.fail_on(
    ("missing",), "The verdict, the ripples, the diagnosis or an order spectrum is not there."
)
def command(
    case: Path,
    out: str,
    explained: str | None,
    diagnosed: str | None,
    as_json: bool,
    fail_on: tuple[str, ...],
) -> int:
    """Show the case in the folder CASE, its verdict and its diagnosis as one HTML page.

    Nothing is calculated again: what is not there, the page says, with the command that makes it.
    """
    from rippletwin.report.page import write_report
    from rippletwin.report.results import read_results

    results = read_results(case, explained, diagnosed)
    path = write_report(results, out)
    warn([*results.case.warnings, *results.missing])
    print(json.dumps({"report": str(path), "missing": list(results.missing)}) if as_json else path)
    return found_code(["missing"] if results.missing else [], fail_on)
