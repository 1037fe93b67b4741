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
    from rippletwin.errors import InputError, raise_any
    from rippletwin.explanation.checks.data_contradictions import plateau_warnings
    from rippletwin.spectra import case_summary

    with progress_bars(as_json, passing=True) as progress:
        read = load_case(case, progress=progress)
    warnings = [*read.warnings, *plateau_warnings(read.rig, read.recordings)]
    warn(warnings)
    summary = case_summary.summarise_rig(read)
    if not as_json:
        print("\n".join(case_summary.rig_in_words(summary)), flush=True)
    summary["recordings"], healthy, errors = [], [], []
    # one thread: the matrices are small, and threads only wait for each other
    with threadpool_limits(1), progress_bars(as_json, passing=True) as progress:
        for recording in read.recordings:
            try:
                found, observation = case_summary.summarise_recording(recording, read.rig, progress)
            except InputError as error:
                errors.append(error)  # of every recording, as `load_case` tells them
                continue
            summary["recordings"].append(found)
            healthy += [observation] * (recording.state == "healthy")
            if not as_json:
                print("\n".join(case_summary.recording_in_words(found)), flush=True)
        raise_any(errors)
        effects = _effects(read, healthy, summary["advice"], progress)
    summary["effects"] = [effect.as_dict() for effect in effects]
    if as_json:
        print(json.dumps(summary))
    else:
        _print_outlook(effects, summary["advice"])
    return found_code(["warning"] if warnings else [], fail_on)


def _effects(case, healthy: list, advice: list[str], progress) -> list:
    """What the healthy recordings could tell of each effect of the library; where explain cannot
    take them together, nothing and a sentence more in `advice`."""
    from rippletwin.case.recording_advice import BAND_HZ
    from rippletwin.explanation.stages.preparation import quantity_error
    from rippletwin.explanation.verdict.expected_confusion import expect_discriminations
    from rippletwin.spectra.frequency_selection import select_fitted_frequencies

    if not healthy:
        return []
    if error := quantity_error(case):
        advice.append(f"{error.problem}. {error.remedy}.")
        return []
    fitted = select_fitted_frequencies(healthy, case.rig, BAND_HZ)
    return list(expect_discriminations(case.rig, fitted, progress))


def _print_outlook(effects: list, advice: list[str]) -> None:
    from rippletwin.explanation.verdict.expected_confusion import describe_discriminations

    if effects:
        print("\n".join(describe_discriminations(effects)))
    for line in advice:
        print(f"advice: {line}")
