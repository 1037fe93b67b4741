"""rippletwin calibrate CASE: fit the twin to a case's healthy recordings."""

from __future__ import annotations

import json
from pathlib import Path

import click

from rippletwin.cli import options
from rippletwin.cli.exit_codes import found_code
from rippletwin.cli.progress import warn


@click.command("calibrate", short_help="fit the twin to a case's healthy recordings")
@options.case
@options.out("Folder for twin.json and report.md.")
@click.option(
    "--friction",
    type=click.Choice(("none", "steady", "unsteady")),
    default="steady",
    show_default=True,
    help="The line's friction law; steady is the paper's.",
)
@options.frequency("--min-frequency", "Use nothing below it.")
@options.frequency("--max-frequency", "Use nothing above it.")
@options.fail_on(("warning",), "A parameter is not determined, or another warning is told.")
@options.json_output
def command(
    case: Path,
    out: str,
    friction: str,
    min_frequency: float | None,
    max_frequency: float | None,
    fail_on: tuple[str, ...],
    as_json: bool,
) -> int:
    """Fit the twin to the healthy recordings of the folder CASE."""
    from rippletwin.calibration import report
    from rippletwin.calibration.calibrate_case import calibrate_case
    from rippletwin.case.load import load_case

    read = load_case(case, states={"healthy"}, band_hz=(min_frequency, max_frequency))
    warn(read.warnings)
    progress = None if as_json else print
    calibration = calibrate_case(read, friction, progress)
    report.save(calibration, out)
    if as_json:
        left_out = ("twin", "covariance")
        result = {k: v for k, v in report.to_dict(calibration).items() if k not in left_out}
        print(json.dumps(result))
    else:
        before, after = calibration.before, calibration.after
        print(f"relative misfit {before.relative:.1%} -> {after.relative:.1%}")
        print(f"Theil's coefficient {before.theil:.3f} -> {after.theil:.3f}")
    warn(calibration.warnings)
    warned = bool(calibration.warnings or read.warnings)
    return found_code(["warning"] if warned else [], fail_on)
