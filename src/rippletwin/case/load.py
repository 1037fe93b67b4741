"""load_case: from a folder with a rig.yaml to a checked Case."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from rippletwin.case import checks, tables
from rippletwin.case.model import (
    STATE_CODES,
    Case,
    Fluid,
    Load,
    Recording,
    Rig,
    Segment,
    Sensor,
    Uncertainty,
)
from rippletwin.case.readers.registry import reader_of
from rippletwin.case.rig_yaml import read_sheet
from rippletwin.errors import InputError

SAMPLED = ("periodic", "random")


def load_case(folder: str | Path, states: Collection[str] | None = None) -> Case:
    """Read and check a case folder.

    Parameters
    ----------
    folder : holds rig.yaml and the files it names.
    states : read only recordings of these states (labels of rig.yaml, e.g. {"healthy"}); all where
        None. The sheet is checked whole in any case.

    Raises
    ------
    InputError : at the first fault of the sheet or of a recording.
    ValueError : where `states` holds a label that does not exist.
    """
    if states is not None and (strange := set(states) - set(STATE_CODES)):
        raise ValueError(f"unknown states {sorted(strange)}; known: {', '.join(STATE_CODES)}")
    folder = Path(folder)
    sheet_path = folder / "rig.yaml"
    sheet = read_sheet(sheet_path)
    rig = _rig(folder, sheet_path, sheet)
    checks.check_sheet(sheet_path, sheet, rig)
    recordings = tuple(
        _recording(folder, sheet_path, entry, rig)
        for entry in sheet["recordings"]
        if states is None or entry["state"] in states
    )
    return Case(folder=folder, rig=rig, recordings=recordings)


def _rig(folder: Path, sheet_path: Path, sheet: dict) -> Rig:
    return Rig(
        fluid=Fluid(**sheet["fluid"]),
        pump=dict(sheet.get("pump", {})),
        line=tuple(Segment(**segment) for segment in sheet["line"]["segments"]),
        sensors=tuple(Sensor(**sensor) for sensor in sheet.get("sensors", [])),
        load=_load(folder, sheet_path, sheet["load"]),
        uncertainty=Uncertainty(**sheet.get("uncertainty", {})),
    )


def _load(folder: Path, sheet_path: Path, entry: dict) -> Load:
    numbers = {key: entry[key] for key in ("coefficient", "back_pressure") if key in entry}
    kind = entry.get("kind", "impedance")
    if (kind == "impedance") != ("impedance" in entry):
        raise InputError(
            sheet_path,
            "load.impedance",
            "missing" if kind == "impedance" else f"given, but the load's kind is {kind}",
            "A load of kind impedance names its file in the key impedance; no other kind does",
        )
    if kind != "impedance":
        return Load(kind=kind, **numbers)
    path = checks.existing(folder, sheet_path, "load.impedance", entry["impedance"])
    frequency_hz, impedance = tables.read_impedance(path)
    return Load(kind=kind, frequency_hz=frequency_hz, impedance=impedance, **numbers)


def _recording(folder: Path, sheet_path: Path, entry: dict, rig: Rig) -> Recording:
    path = folder / entry["file"]
    kind = entry.get("kind", "periodic")
    fields = {
        key: entry[key]
        for key in ("state", "speed_rpm", "load_pressure", "relative_error", "normalised")
        if key in entry
    }
    fields.update(file=path, kind=kind, label=entry.get("label", path.stem))
    if "flow_ripple" in entry:
        fields["flow_ripple"] = tables.read_flow_ripple(folder / entry["flow_ripple"])
    if kind not in SAMPLED:
        files = [path, *(folder / name for name in entry.get("repeats", []))]
        names = [sensor.name for sensor in rig.sensors] if kind == "spectrum" else None
        frequency_hz, spectra = tables.read_repeats(files, names)
        return Recording(**fields, frequency_hz=frequency_hz, spectra=spectra)
    signals = reader_of(path)(path, [sensor.name for sensor in rig.sensors])
    rate = checks.sampling_rate(path, signals, entry.get("sampling_rate_hz"))
    recording = Recording(**fields, pressure=signals.pressure, sampling_rate_hz=rate)
    checks.check_signals(recording, rig)
    return recording
