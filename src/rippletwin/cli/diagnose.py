"""rippletwin diagnose CASE: say what is wrong with the pump in recordings of unknown state."""

from __future__ import annotations

import json
import os
from pathlib import Path

import click

from rippletwin.cli import options
from rippletwin.cli.exit_codes import found_code
from rippletwin.cli.progress import progress_bars, warn


@click.command(
    "diagnose", short_help="say what is wrong with the pump in recordings of unknown state"
)
@options.case
@options.out("Folder for diagnosis.json and figures.")
@click.option(
    "--twin",
    "twin_file",
    metavar="TWIN.json",
    help="The twin, as explain or calibrate wrote it; without it the healthy recordings are "
    "explained first, and verdict.json and twin.json are written too.",
)
@click.option(
    "--recording",
    "labels",
    multiple=True,
    metavar="LABEL",
    help="Diagnose this one, again for more; all of unknown state by default.",
)
@click.option(
    "--faults",
    "fault_names",
    multiple=True,
    metavar="FILE",
    help="Also try the fault that a Python file defines as FAULT, or one of the library that is "
    "not tried by default, by its name (valve_plate).",
)
@options.effects(
    "An effect of the twin that a Python file defines as EFFECT, again for more; explain tries it "
    "too."
)
@click.option(
    "--networks",
    "results",
    metavar="RESULTS",
    help="Also ask the networks that a workflow has trained on randomised datasets.",
)
@options.json_output
@options.processes("explain")
@options.no_figures
@options.fail_on(("fault", "unlike"), "A recording is faulty, or unlike all that was tried.")
def command(
    case: Path,
    out: str,
    twin_file: str | None,
    labels: tuple[str, ...],
    fault_names: tuple[str, ...],
    effects: tuple[str, ...],
    results: str | None,
    as_json: bool,
    processes: int,
    no_figures: bool,
    fail_on: tuple[str, ...],
) -> int:
    """Say what is wrong with the pump in recordings of the folder CASE; write diagnosis.json.

    Answers of an earlier call with the same --out are kept where nothing that they were made from
    has changed.
    """
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    from rippletwin.case.load import load_case
    from rippletwin.diagnosis.diagnose import select_recordings
    from rippletwin.diagnosis.diagnosis_file import write_diagnosis
    from rippletwin.diagnosis.faults.library import select_faults
    from rippletwin.diagnosis.input_warnings import find_warnings
    from rippletwin.diagnosis.kept_answers import diagnose_changed
    from rippletwin.twin.effects.library import add_effects

    faults = select_faults(list(fault_names))
    states = None if labels else {"healthy", "unknown"}
    read = load_case(case, states=states)
    add_effects(effects, read.rig)
    warn(read.warnings)
    recordings = select_recordings(read, list(labels))
    networks = _networks_of(results, read)
    with progress_bars(as_json) as progress:
        twin, verdict = _twin_of(twin_file, out, processes, read, recordings, progress)
        found = diagnose_changed(read, twin, recordings, faults, out, progress)
    entries = [each.entry for each in found]
    warnings = find_warnings(read, twin, recordings, verdict)
    warn(each for each in warnings if each not in read.warnings)
    result = write_diagnosis(entries, out, _answers(networks, recordings, read), warnings)
    from rippletwin.figures.fault_posterior import draw, remove_figures  # takes a second

    if no_figures:
        remove_figures(out)
    else:
        draw([each.numbers for each in found], out)
    if as_json:
        print(json.dumps(result))
    else:
        print("\n".join(each["sentence"] for each in result["recordings"]))
    said = {each["state"] for each in result["recordings"]}
    faulty = ["fault"] if said - {"healthy", "unlike"} else []
    return found_code([*faulty, *(said & {"unlike"})], fail_on)


def _networks_of(results: str | None, case) -> dict:
    """The networks in the folder that the command line names, none where it names none."""
    if results is None:
        return {}
    from rippletwin.diagnosis.network_answers import find_networks

    return find_networks(results, case.rig)


def _answers(networks: dict, recordings, case) -> dict:
    """What networks say of recordings, by label, with a warning where they are not asked."""
    if not networks:
        return {}
    from rippletwin.diagnosis.network_answers import ask_networks

    answers = ask_networks(networks, recordings, case.rig)
    warn(
        f"{label}: not shown to networks of another operating point"
        for label, said in answers.items()
        if len(said) < len(networks)
    )
    return answers


def _twin_of(twin_file: str | None, out: str, processes: int, case, recordings, progress):
    """The twin that the command line names, or the one that explains the healthy recordings, with
    its verdict ({} of a twin that is named).

    Raises InputError as `check_recordings`, before anything is explained."""
    if twin_file is not None:
        from rippletwin.twin.twin_file import load_twin

        return load_twin(twin_file), {}
    from dataclasses import replace

    from rippletwin.diagnosis.diagnose import check_recordings
    from rippletwin.explanation.explain import explain
    from rippletwin.explanation.verdict.verdict_file import write_verdict

    check_recordings(case, recordings)
    diagnosed = {recording.label for recording in recordings}
    known = tuple(r for r in case.recordings if r.label not in diagnosed)
    explanation = explain(replace(case, recordings=known), processes, progress)
    verdict = write_verdict(explanation, out)
    from rippletwin.figures.explanation import remove_figures

    remove_figures(out)  # of an earlier explanation in this folder
    return explanation.twin, verdict
