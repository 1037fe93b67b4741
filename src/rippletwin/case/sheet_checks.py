"""What the schema of rig.yaml cannot say: kinds have their keys, names are unique, files exist.

A sheet is a mapping that may still violate its schema: every fault is found at once, so each check
looks only at values of the right type.
"""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterator
from pathlib import Path

from rippletwin.case.readers.registry import FOLDERS
from rippletwin.case.sheet_values import entries, line_length, mapping, number
from rippletwin.errors import InputError, printable

LONGEST_LABEL = 200  # bytes; a file's name has 255, and a label is the middle of it
LONGEST_FILE_NAME = 255  # bytes
FORBIDDEN_IN_LABELS = "/\\"  # labels name files of results
DATA_FOLDERS = "RIPPLETWIN_DATA"  # environment variable: folders besides a case's to read from
SAME_PLACE = 1e-3  # m; closer together two sensors are one

OF_SAMPLES = ("dataset", "orientation", "channels", "unit", "scale")
"""Keys that say how the samples of a file are read. A table has columns of its own."""
HARMLESS = {"unit": "Pa", "scale": 1}
"""Values of such keys that say what is so in any case."""
COLUMNS = {
    "spectrum": "frequency_hz,p1_re,p1_im,... in Pa",
    "input_impedance": "frequency_hz,re,im in Pa s/m3, or normalised: true",
}
"""Of the kinds of recording that are tables."""


def sheet_errors(path: Path, sheet: dict) -> list[InputError]:
    """Every fault of a sheet that concerns several of its values."""
    return [
        *_load_errors(path, sheet),
        *_sensor_errors(path, sheet),
        *_recording_errors(path, sheet),
        *_label_errors(path, sheet),
    ]


def _load_errors(path: Path, sheet: dict) -> Iterator[InputError]:
    load = mapping(sheet, "load")
    kind = load.get("kind", "impedance")
    if not load or not isinstance(kind, str):
        return
    if (kind == "impedance") != ("impedance" in load):
        yield InputError(
            path,
            "load.impedance",
            "missing" if kind == "impedance" else f"given, but the load's kind is {kind}",
            "A load of kind impedance names its file in the key impedance; no other kind does",
        )


def _sensor_errors(path: Path, sheet: dict) -> Iterator[InputError]:
    sensors, length = entries(sheet, "sensors"), line_length(sheet)
    placed: list[tuple[object, float]] = []
    names: dict[str, int] = {}
    for index, sensor in enumerate(sensors):
        name, position = sensor.get("name"), number(sensor, "position")
        if isinstance(name, str):
            if name in names:
                problem = f"{name} is the name of sensors[{names[name]}] too"
                yield InputError(path, f"sensors[{index}].name", problem, "Give each its own name")
            names.setdefault(name, index)
        if position is None:
            continue
        field = f"sensors[{index}].position"
        if length is not None and position > length:
            in_mm = f"; {position:g} mm would be {position / 1000:g} m"
            hint = in_mm if position / 1000 <= length and position >= 10 else ""
            yield InputError(
                path,
                field,
                f"{position:g} m is outside the line, which is {length:g} m long{hint}",
                "Positions count from the pump outlet, in metres; correct it or the segments",
            )
        for other, place in placed:
            if abs(position - place) < SAME_PLACE:
                yield InputError(
                    path,
                    field,
                    f"{position:g} m is where {other} is too",
                    "Two sensors need different positions: correct one of them, or take one sensor "
                    "out",
                )
        placed.append((name, position))


def _recording_errors(path: Path, sheet: dict) -> Iterator[InputError]:
    names = [sensor.get("name") for sensor in entries(sheet, "sensors")]
    load_kind = mapping(sheet, "load").get("kind")
    geometry = bool(set(mapping(sheet, "pump")) - {"pistons"})
    reported: set[tuple[str, bool]] = set()
    for index, entry in enumerate(entries(sheet, "recordings")):
        field = f"recordings[{index}]"
        kind = entry.get("kind", "periodic")
        healthy = entry.get("state") == "healthy"
        simulated = geometry and healthy and "flow_ripple" not in entry
        for key, why in _needed(kind, load_kind, simulated):
            whole = key in ("pump", "sensors")
            if (sheet.get(key) if whole else key in entry) or (key, whole) in reported:
                continue
            if whole:  # once for all recordings
                reported.add((key, whole))
            yield InputError(path, key if whole else f"{field}.{key}", "missing", f"{why}; give it")
        for key in OF_SAMPLES if isinstance(kind, str) and kind in COLUMNS else ():
            if key in entry and entry[key] != HARMLESS.get(key):
                problem = f"means nothing for a recording of kind {kind}"
                remedy = f"Take it out of rig.yaml; the table has columns {COLUMNS[kind]}"
                yield InputError(path, f"{field}.{key}", problem, remedy)
        yield from _channel_errors(path, field, mapping(entry, "channels"), names)
        low, high = number(entry, "min_frequency_hz"), number(entry, "max_frequency_hz")
        if low is not None and high is not None and low >= high:
            problem = f"{low:g} Hz is not below max_frequency_hz, {high:g} Hz"
            yield InputError(path, f"{field}.min_frequency_hz", problem, "Correct one of them")
        if kind == "random" and len(names) == 1 and ("random", True) not in reported:
            reported.add(("random", True))
            yield InputError(
                path, "sensors", "one sensor only", "A random recording needs two or more"
            )


def _channel_errors(path: Path, field: str, channels: dict, names: list) -> Iterator[InputError]:
    """Channels of what is no sensor, and channels that two sensors share."""
    # a sensor without a channel in the sheet has that of its own name
    first: dict[object, object] = {s: s for s in names if isinstance(s, str) and s not in channels}
    for sensor, channel in channels.items():
        if sensor not in names:
            near = difflib.get_close_matches(str(sensor), [n for n in names if isinstance(n, str)])
            hint = f"Did you mean {near[0]}? " if near else ""
            remedy = f"{hint}Each key of channels is the name of a sensor of rig.yaml"
            yield InputError(path, f"{field}.channels.{sensor}", "no such sensor", remedy)
        elif isinstance(channel, (int, float, str)) and channel in first:
            problem = f"{channel} is the channel of {first[channel]} too"
            remedy = "Give each sensor its own channel"
            yield InputError(path, f"{field}.channels.{sensor}", problem, remedy)
        elif isinstance(channel, (int, float, str)):
            first[channel] = sensor


def _needed(kind: object, load_kind: object, simulated: bool) -> list[tuple[str, str]]:
    """Keys that a kind of recording needs, and why; `simulated` where the pump's geometry stands
    for a flow ripple."""
    if kind == "periodic":
        needed = [
            ("pump", "The number of pistons of a periodic recording must be known"),
            ("sensors", "A periodic recording needs sensors"),
            ("speed_rpm", "A periodic recording needs its nominal speed"),
        ]
        if load_kind == "orifice":
            needed.append(("load_pressure", "The orifice's law needs the mean load pressure"))
        elif simulated:
            why = "The pump is simulated against the mean load pressure"
            needed.append(("load_pressure", why))
        return needed
    known = kind in ("random", "spectrum")
    return [("sensors", f"A {kind} recording needs sensors")] if known else []


def _label_errors(path: Path, sheet: dict) -> Iterator[InputError]:
    """Labels that are given twice, or cannot be part of a file's name.

    Without `label` a recording is called after its file, without folder and suffix.
    """
    first: dict[str, int] = {}
    for index, entry in enumerate(entries(sheet, "recordings")):
        file, label = entry.get("file"), entry.get("label")
        given = isinstance(label, str)
        if not given:
            if "label" in entry or not isinstance(file, str):
                continue
            label = Path(file).stem
        field = f"recordings[{index}].label"
        bad = any(c in FORBIDDEN_IN_LABELS or not c.isprintable() for c in label)
        size = len(label.encode(errors="replace"))
        if given and (bad or not label.strip(" .") or size > LONGEST_LABEL):
            yield InputError(
                path,
                field,
                f"{printable(label, 50)!r} cannot be part of a file's name",
                f"Give up to {LONGEST_LABEL} bytes (letters beyond a to z have two or more) "
                "without / and \\",
            )
        # a longer name is no file's, which is told where files are looked for
        exists = not given and len(Path(file).name.encode(errors="replace")) <= LONGEST_FILE_NAME
        if exists and size > LONGEST_LABEL:
            problem = f"missing, and the file's name, {size} bytes, is too long to be one"
            remedy = f"Give the recording a label of up to {LONGEST_LABEL} bytes"
            yield InputError(path, field, problem, remedy)
        if label in first:
            source = "" if given else " (the file's name, as there is no label)"
            yield InputError(
                path,
                field,
                f"{label!r}{source} is that of recordings[{first[label]}] too",
                "Give each recording a label of its own",
            )
        first.setdefault(label, index)


def missing_files(path: Path, sheet: dict) -> list[InputError]:
    """An error for every file that a sheet names and that is not there, or is not to be read: a
    case comes from anybody, so its files lie in its folder, or in a folder of DATA_FOLDERS."""
    named = [("load.impedance", mapping(sheet, "load").get("impedance"))]
    for index, entry in enumerate(entries(sheet, "recordings")):
        field, repeats = f"recordings[{index}]", entry.get("repeats")
        named += [(f"{field}.{key}", entry.get(key)) for key in ("file", "flow_ripple")]
        for count, name in enumerate(repeats if isinstance(repeats, list) else []):
            named.append((f"{field}.repeats[{count}]", name))
    return [
        e for field, name in named if isinstance(name, str) for e in _missing(path, field, name)
    ]


def _folders_to_read(case: Path) -> list[Path]:
    """The case's folder and those that the user allows, links followed."""
    allowed = os.environ.get(DATA_FOLDERS, "").split(os.pathsep)
    return [case.resolve(), *(Path(each).resolve() for each in allowed if each)]


def _missing(path: Path, field: str, name: str) -> Iterator[InputError]:
    remedy = "Correct the name (relative to rig.yaml) or add the file"
    try:
        real = (path.parent / name).resolve()
        if not any(real.is_relative_to(folder) for folder in _folders_to_read(path.parent)):
            problem = f"{printable(name, 80)} leads out of the folder of rig.yaml"
            remedy = f"Copy the file into it, or allow its folder: {DATA_FOLDERS}=FOLDER"
            yield InputError(path, field, problem, remedy)
            return
        if (path.parent / name).is_file():
            return
        folder = (path.parent / name).is_dir()
        if folder and Path(name).suffix.lower() in FOLDERS:
            return
        problem = f"{name} is a folder" if folder else f"there is no file {name} beside rig.yaml"
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        problem = f"{printable(name, 80)} cannot be opened: {reason}"
    yield InputError(path, field, problem, remedy)
