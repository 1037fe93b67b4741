"""rippletwin export CASE: ripples, spectra, a twin's values and its line for other programs."""

from __future__ import annotations

import json
from pathlib import Path

import click

from rippletwin.cli import options
from rippletwin.cli.progress import progress_bars, warn


@click.command("export", short_help="write ripples and spectra as CSV and MAT, a twin as JSON")
@options.case
@options.out("Folder for the files.")
@click.option(
    "--recording",
    "labels",
    multiple=True,
    metavar="LABEL",
    help="Export this one, again for more; all by default.",
)
@click.option(
    "--twin",
    "twin_file",
    metavar="TWIN.json",
    help="Also write this twin's values with their units to twin_values.json.",
)
@click.option(
    "--state-space",
    is_flag=True,
    help="Also write the line of --twin as a state space at each periodic recording's operating "
    "point.",
)
@options.effects("An effect of the twin that a Python file defines as EFFECT, again for more.")
@options.frequency("--min-frequency", "Export nothing below it.")
@options.frequency("--max-frequency", "Export nothing above it; by default 5 kHz of a recording.")
@options.json_output
def command(
    case: Path,
    out: str,
    labels: tuple[str, ...],
    twin_file: str | None,
    state_space: bool,
    effects: tuple[str, ...],
    min_frequency: float | None,
    max_frequency: float | None,
    as_json: bool,
) -> None:
    """Write what the recordings of the folder CASE hold, for other programs.

    LABEL_ripple.csv is the mean revolution, LABEL_spectrum.csv its shaft orders; LABEL.mat is both.
    """
    from rippletwin.case.load import load_case
    from rippletwin.errors import InputError
    from rippletwin.report.data_export import (
        export_observation,
        export_state_space,
        export_twin,
    )
    from rippletwin.spectra.frequency_selection import select_frequencies
    from rippletwin.spectra.observation import observe
    from rippletwin.twin.twin_file import load_covariance, load_twin

    if state_space and twin_file is None:
        raise InputError(
            "command line", "--state-space", "whose line?", "Give --twin TWIN.json beside it"
        )
    twin = None if twin_file is None else load_twin(twin_file, effects)
    read = load_case(case, band_hz=(min_frequency, max_frequency))
    known = {recording.label: recording for recording in read.recordings}
    for label in labels:
        if label not in known:
            remedy = f"There are {', '.join(known)}"
            raise InputError("command line", "--recording", f"no recording {label}", remedy)
    warn(read.warnings)
    written = []
    chosen = [known[label] for label in dict.fromkeys(labels or known)]
    with progress_bars(as_json) as progress:
        for done, recording in enumerate(chosen, 1):
            observation = observe(recording, read.rig)
            # A fit needs the shaft orders below the band too; here they are left out.
            in_band = observation.frequency_hz >= observation.min_frequency_hz
            observation = select_frequencies(observation, in_band)
            written += export_observation(observation, out)
            if state_space and observation.kind == "periodic":
                written += export_state_space(twin, observation, out)
            progress("exporting", done, len(chosen))
    if twin is not None:
        covariance = load_covariance(twin_file)
        written.append(export_twin(twin, covariance, Path(out) / "twin_values.json"))
    files = [str(path) for path in written]
    print(json.dumps({"files": files}) if as_json else "\n".join(files))
