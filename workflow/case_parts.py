"""What of a case a job depends on: the recordings that it uses, and what rig.yaml says of them.

rig.yaml describes everything, and no job uses all of it. A job states its purpose and the sections
that it reads. It depends on the content of these sections and of its purpose's recordings, written
in one normal form: comments, the order of keys, 9.5e6 or 9500000 make no difference. The age of the
file makes none either.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable

from rippletwin.case.diagnosed_point import reference_recordings, unknown_recordings
from rippletwin.case.load import label_of, unread_recordings
from rippletwin.case.model import Recording

NAMED_FILES = ("file", "flow_ripple")
"""Keys of a recording's entry that name one file."""


def _healthy(recordings: list[Recording]) -> list[Recording]:
    return [recording for recording in recordings if recording.state == "healthy"]


def _of_periodic(
    choose: Callable[[list[Recording]], list[Recording]],
) -> Callable[[list[Recording]], list[Recording]]:
    """`choose`, of a case that may have no periodic recording."""
    return lambda recordings: (
        choose(recordings) if any(r.kind == "periodic" for r in recordings) else []
    )


PURPOSES: dict[str, Callable[[list[Recording]], list[Recording]]] = {
    "fit": _healthy,
    "reference": _of_periodic(reference_recordings),
    "unknown": _of_periodic(unknown_recordings),
    "all": lambda recordings: recordings,
}
"""Purpose -> the recordings that serve it: `fit` the twin, be the `reference` of simulated faults
and of scores, be told by networks as `unknown`."""


def recordings_for(sheet: dict, purpose: str) -> list[dict]:
    """Entries of a sheet without faults whose recordings serve a purpose, in the sheet's order."""
    chosen = {recording.label for recording in PURPOSES[purpose](unread_recordings(sheet))}
    return [entry for entry in sheet["recordings"] if label_of(entry) in chosen]


def files_for(sheet: dict, purpose: str, folder: str) -> list[str]:
    """Files that a job for a purpose reads besides the rig.yaml in `folder`; sorted.

    A name may be absolute (RIPPLETWIN_DATA allows it), and `folder` is empty for this one.
    """
    load = sheet["load"]
    files = {load["impedance"]} if "impedance" in load else set()
    for entry in recordings_for(sheet, purpose):
        files |= {entry[key] for key in NAMED_FILES if key in entry}
        files |= set(entry.get("repeats", ()))
    return sorted(os.path.join(folder, name) for name in files)


def is_scored(sheet: dict) -> bool:
    """Whether a recording of a known fault is there to score networks with."""
    return any(e["state"] != "healthy" for e in _known(recordings_for(sheet, "reference")))


def has_known(sheet: dict) -> bool:
    """Whether a recording of known state is at the diagnosed point, to compare simulations with."""
    return bool(_known(recordings_for(sheet, "reference")))


def _known(entries: list[dict]) -> list[dict]:
    return [entry for entry in entries if entry["state"] != "unknown"]


def is_diagnosed(sheet: dict) -> bool:
    """Whether a periodic recording is not healthy, so that the twin tells its state."""
    return any(r.kind == "periodic" and r.state != "healthy" for r in unread_recordings(sheet))


def has_periodic(sheet: dict) -> bool:
    """Whether there is a pump's ripple, for which faults can be simulated."""
    return bool(recordings_for(sheet, "reference"))


def normal_form(value: object) -> str:
    """A value of a sheet as text that is the same for all ways to write it."""
    return json.dumps(_with_floats(value), sort_keys=True)


def _with_floats(value: object) -> object:
    """`value` with every number as a float: 9 and 9.0 are one number of pistons."""
    if isinstance(value, dict):
        return {key: _with_floats(part) for key, part in value.items()}
    if isinstance(value, list):
        return [_with_floats(part) for part in value]
    whole = isinstance(value, int) and not isinstance(value, bool)
    return float(value) if whole else value
