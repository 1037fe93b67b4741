"""load_case: from a folder with a rig.yaml to a checked Case."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from rippletwin.case import tables
from rippletwin.case.band import band_warnings, limit_to_ripple, narrow_band
from rippletwin.case.model import (
    STATE_CODES,
    Case,
    FlowRipple,
    Fluid,
    Load,
    Recording,
    Rig,
    Segment,
    Sensor,
    Uncertainty,
)
from rippletwin.case.plausibility import unusual_values
from rippletwin.case.pressure_units import PASCALS, count_warnings, mean_warnings
from rippletwin.case.readers.layout import Layout
from rippletwin.case.readers.registry import read_signals
from rippletwin.case.rig_yaml import find_sheet, find_sheet_faults, parse_sheet
from rippletwin.case.sheet_checks import missing_files
from rippletwin.case.signal_checks import sampling_rate, signal_errors
from rippletwin.errors import InputError, raise_any

COPIED_KEYS = (
    "state", "speed_rpm", "load_pressure", "relative_error", "normalised",
    "min_frequency_hz", "max_frequency_hz",
)  # fmt: skip
"""Keys of a recording's entry that its fields have as they are."""
SAMPLED = ("periodic", "random")
LARGEST_VELOCITY = 100.0  # m/s, mean, of a liquid; lines are designed for 0.5 to 6


def load_case(
    folder: str | Path,
    states: Collection[str] | None = None,
    progress: Callable[[str, int, int], None] | None = None,
    band_hz: tuple[float | None, float | None] = (None, None),
    labels: Collection[str] | None = None,
) -> Case:
    """Read and check a case.

    Parameters
    ----------
    folder : holds rig.yaml and the files it names; or that rig.yaml.
    states : read only recordings of these states (labels of rig.yaml, e.g. {"healthy"}); all where
        None. The sheet is checked whole in any case.
    progress : called with "reading", how many recordings have been read, and of how many.
    band_hz : lowest and highest frequency to use of every recording, within its own band.
    labels : read only recordings of these labels; all where None.

    Raises
    ------
    InputError : for all faults of the sheet; where it has none, for all faults of the recordings.
    ValueError : where `states` holds a label that does not exist.
    """
    if states is not None and (strange := set(states) - set(STATE_CODES)):
        raise ValueError(f"unknown states {sorted(strange)}; known: {', '.join(STATE_CODES)}")
    sheet_path = find_sheet(folder)
    folder = sheet_path.parent
    sheet = parse_sheet(sheet_path)
    raise_any([*find_sheet_faults(sheet_path, sheet), *missing_files(sheet_path, sheet)])
    rig = rig_of(folder, sheet)
    recordings, errors, limits = [], [], []
    chosen = [
        entry
        for entry in sheet["recordings"]
        if (states is None or entry["state"] in states)
        and (labels is None or label_of(entry) in labels)
    ]
    for done, entry in enumerate(chosen, 1):
        try:
            recording = narrow_band(_recording(folder, entry, rig), *band_hz)
            recording, limited = limit_to_ripple(recording)
            recordings.append(recording)
            limits += limited
            limits += mean_warnings(recording, rig)
            if "scale" not in entry:
                limits += count_warnings(recording, rig)
        except InputError as error:
            errors.append(error)
        if progress is not None:
            progress("reading", done, len(chosen))
    raise_any(errors)
    rig = replace(rig, displacement=_displacement(recordings))
    warnings = [*unusual_values(sheet_path, sheet), *limits, *band_warnings(rig, recordings)]
    return Case(folder=folder, rig=rig, recordings=tuple(recordings), warnings=tuple(warnings))


def label_of(entry: dict) -> str:
    """What a recording is called: its label, or its file's name without folder and suffix."""
    return entry.get("label", Path(entry["file"]).stem)


def unread_recordings(sheet: dict) -> list[Recording]:
    """The recordings of a sheet without faults as it describes them, none of their files read."""
    return [Recording(**_described(Path(entry["file"]), entry)) for entry in sheet["recordings"]]


def _described(path: Path, entry: dict) -> dict:
    """Fields of a recording that its entry gives."""
    fields = {key: entry[key] for key in COPIED_KEYS if key in entry}
    return {**fields, "file": path, "kind": entry.get("kind", "periodic"), "label": label_of(entry)}


def rig_of(folder: Path, sheet: dict) -> Rig:
    """The rig of a sheet without faults; a measured load impedance is read from `folder`."""
    pump = dict(sheet.get("pump", {}))
    if "pistons" in pump:
        pump["pistons"] = int(pump["pistons"])  # 9.0 is a whole number too
    return Rig(
        fluid=Fluid(**sheet["fluid"]),
        pump=pump,
        line=tuple(Segment(**segment) for segment in sheet["line"]["segments"]),
        sensors=tuple(Sensor(**sensor) for sensor in sheet.get("sensors", [])),
        load=_load(folder, sheet["load"]),
        uncertainty=Uncertainty(**sheet.get("uncertainty", {})),
    )


def _load(folder: Path, entry: dict) -> Load:
    numbers = {key: entry[key] for key in ("coefficient", "back_pressure") if key in entry}
    kind = entry.get("kind", "impedance")
    if kind != "impedance":
        return Load(kind=kind, **numbers)
    frequency_hz, impedance = tables.read_impedance(folder / entry["impedance"])
    return Load(kind=kind, frequency_hz=frequency_hz, impedance=impedance, **numbers)


def _recording(folder: Path, entry: dict, rig: Rig) -> Recording:
    path = folder / entry["file"]
    fields = _described(path, entry)
    kind = fields["kind"]
    if "flow_ripple" in entry:
        ripple = tables.read_flow_ripple(folder / entry["flow_ripple"])
        _check_mean_flow(folder / entry["flow_ripple"], ripple, rig)
        fields["flow_ripple"] = ripple
    if kind not in SAMPLED:
        files = [path, *(folder / name for name in entry.get("repeats", []))]
        names = [sensor.name for sensor in rig.sensors] if kind == "spectrum" else None
        frequency_hz, spectra = tables.read_repeats(files, names)
        return Recording(**fields, frequency_hz=frequency_hz, spectra=spectra)
    signals = read_signals(path, Layout.of((sensor.name for sensor in rig.sensors), entry))
    rate = sampling_rate(path, signals, entry.get("sampling_rate_hz"))
    if signals.counts and "scale" not in entry:
        raise InputError(
            path,
            "scale",
            "missing: the file holds whole numbers, which are raw counts",
            "Give scale in rig.yaml: the recorder's, Pa a count, or 1 where they are pressures",
        )
    factor = entry.get("scale", 1.0) * PASCALS[entry.get("unit", "Pa")]
    pressure = signals.pressure if factor == 1.0 else signals.pressure * factor
    recording = Recording(**fields, pressure=pressure, sampling_rate_hz=rate)
    raise_any(signal_errors(recording, rig))
    return recording


def _displacement(recordings: Sequence[Recording]) -> float | None:
    """Flow per revolution, m3, of the stated flow ripples; None without one."""
    stated = [
        abs(r.flow_ripple.stated_mean) / (r.speed_rpm / 60.0)
        for r in recordings
        if r.flow_ripple is not None and r.flow_ripple.stated_mean and r.speed_rpm
    ]
    return float(np.mean(stated)) if stated else None


def _check_mean_flow(path: Path, ripple: FlowRipple, rig: Rig) -> None:
    """Raise InputError where an orifice's coefficient has to come from a mean flow of zero, and
    where a liquid would be impossibly fast in the line."""
    mean, area = ripple.stated_mean, min(segment.area for segment in rig.line)
    if mean is not None and not rig.fluid.is_gas and mean > LARGEST_VELOCITY * area:
        raise InputError(
            path,
            "flow_m3_s",
            f"the mean flow of {mean:.3g} m3/s is {mean / area:.3g} m/s in the narrowest segment",
            "Give m3/s: divide L/s by 1000, L/min by 60000, kg/s by the density",
        )
    if rig.load.passes_flow and mean is None:
        raise InputError(
            path,
            "flow_m3_s",
            "the mean flow is zero, but the orifice's coefficient follows from it",
            "Add the mean flow, or give load.coefficient in rig.yaml",
        )
