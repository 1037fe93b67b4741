"""Checks of what a user gives: each failure names file, field and remedy."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rippletwin.case.model import Recording, Rig
from rippletwin.case.readers.signals import Signals
from rippletwin.case.speed_estimate import estimate_speed
from rippletwin.errors import InputError

FEWEST_REVOLUTIONS = 4
RATE_TOLERANCE = 1e-3
SPEED_TOLERANCE = 0.01
LONGEST_FLAT_S = 0.02  # for random recordings; periodic ones use the piston period


def existing(folder: Path, sheet_path: Path, field: str, name: str) -> Path:
    """The path of a file that the sheet names; raises InputError where it is not there."""
    path = folder / name
    if not path.is_file():
        raise InputError(
            sheet_path,
            field,
            f"there is no file {name} beside rig.yaml",
            "Correct the name (relative to rig.yaml) or add the file",
        )
    return path


def check_sheet(path: Path, sheet: dict, rig: Rig) -> None:
    """What the schema cannot say: sensors lie on the line, files exist, kinds have their keys."""
    names = [sensor.name for sensor in rig.sensors]
    for index, sensor in enumerate(rig.sensors):
        if sensor.position > rig.length:
            raise InputError(
                path,
                f"sensors[{index}].position",
                f"{sensor.position:g} m is outside the line, which is {rig.length:g} m long",
                "Positions count from the pump outlet, in metres; correct it or the segments",
            )
        if names.count(sensor.name) > 1:
            raise InputError(
                path, f"sensors[{index}].name", f"{sensor.name} twice", "Give each its own name"
            )
    for index, entry in enumerate(sheet["recordings"]):
        field = f"recordings[{index}]"
        kind = entry.get("kind", "periodic")
        for key in ("file", "flow_ripple"):
            if key in entry:
                existing(path.parent, path, f"{field}.{key}", entry[key])
        for number, name in enumerate(entry.get("repeats", [])):
            existing(path.parent, path, f"{field}.repeats[{number}]", name)
        for key, why in _needed(kind, rig):
            if key not in entry and key not in sheet:
                where = key if key in ("pump", "sensors") else f"{field}.{key}"
                raise InputError(path, where, "missing", f"{why}; give it")
        if kind == "random" and len(names) < 2:
            raise InputError(
                path, "sensors", "one sensor only", "A random recording needs two or more"
            )


def _needed(kind: str, rig: Rig) -> list[tuple[str, str]]:
    if kind == "periodic":
        needed = [
            ("pump", "The number of pistons of a periodic recording must be known"),
            ("sensors", "A periodic recording needs sensors"),
            ("speed_rpm", "A periodic recording needs its nominal speed"),
        ]
        if rig.load.kind == "orifice":
            needed.append(("load_pressure", "The orifice's law needs the mean load pressure"))
        return needed
    return [] if kind == "input_impedance" else [("sensors", f"A {kind} recording needs sensors")]


def sampling_rate(path: Path, signals: Signals, stated: float | None) -> float:
    """The sampling rate (Hz) that file, time column and sheet agree on; raises InputError."""
    from_time = None if signals.time_s is None else _rate_of_time(path, signals)
    claims = [
        (claim, rate)
        for claim, rate in (
            ("the file's sampling_rate_hz", signals.sampling_rate_hz),
            ("rig.yaml's sampling_rate_hz", stated),
            ("the time column", from_time),
        )
        if rate is not None
    ]
    if not claims:
        raise InputError(
            path,
            "sampling_rate_hz",
            "missing",
            "Store it in the file, or give sampling_rate_hz for this recording in rig.yaml",
        )
    rates = [rate for _, rate in claims]
    if not np.all(np.isfinite(rates)) or min(rates) <= 0:
        raise InputError(path, "sampling_rate_hz", f"{rates} Hz", "Give a positive number")
    if max(rates) - min(rates) > RATE_TOLERANCE * max(rates):
        said = " but ".join(f"{claim} says {rate:.6g} Hz" for claim, rate in claims)
        raise InputError(path, "sampling_rate_hz", said, "Correct the wrong one")
    return claims[0][1]


def _rate_of_time(path: Path, signals: Signals) -> float:
    time, samples = signals.time_s.ravel(), signals.pressure.shape[1]
    if time.size != samples:
        raise InputError(
            path, "time_s", f"{time.size} times for {samples} samples", "One time a sample"
        )
    step = (time[-1] - time[0]) / max(samples - 1, 1)
    off = np.abs(time - time[0] - step * np.arange(samples)) > 0.5 * step
    if not step > 0 or not np.all(np.isfinite(time)) or np.any(off):
        raise InputError(
            path,
            "time_s",
            f"not evenly spaced (first at row {int(np.argmax(off)) + 1})",
            "Samples were dropped or the clock jumped: export one unbroken stretch",
        )
    return 1 / step


def check_signals(recording: Recording, rig: Rig) -> None:
    """Hold a sampled recording against what a pressure ripple looks like; raises InputError."""
    path, pressure = recording.file, recording.pressure
    for sensor, row in zip(rig.sensors, pressure):
        _check_finite(path, sensor.name, row)
    _check_length(recording)
    for sensor, row in zip(rig.sensors, pressure):
        _check_stuck(path, sensor.name, row, _longest_flat(recording, rig))
        _check_clipped(path, sensor.name, row)
        _check_units(recording, sensor.name, row, rig)
    if recording.kind == "periodic":
        _check_speed(recording, rig)


def _check_finite(path: Path, name: str, row: np.ndarray) -> None:
    bad = np.flatnonzero(~np.isfinite(row))
    if bad.size:
        raise InputError(
            path,
            name,
            f"{bad.size} of {row.size} samples are not numbers (NaN), the first at {bad[0]}",
            "Cut the recording to an unbroken stretch; gaps cannot be filled in",
        )


def _check_length(recording: Recording) -> None:
    samples = recording.pressure.shape[1]
    if recording.kind == "random":
        if samples < 1024:
            raise InputError(
                recording.file, "pressure", f"{samples} samples only", "Record at least 1024"
            )
        return
    revolutions = samples / recording.sampling_rate_hz * recording.speed_rpm / 60
    if revolutions < FEWEST_REVOLUTIONS:
        raise InputError(
            recording.file,
            "pressure",
            f"{revolutions:.1f} revolutions at {recording.speed_rpm:g} r/min are too few",
            f"Record at least {FEWEST_REVOLUTIONS}, better 100, or correct speed_rpm",
        )


def _longest_flat(recording: Recording, rig: Rig) -> int:
    seconds = LONGEST_FLAT_S
    if recording.kind == "periodic":
        seconds = 60 / recording.speed_rpm / rig.pump["pistons"]
    return max(int(seconds * recording.sampling_rate_hz), 32)


def _check_stuck(path: Path, name: str, row: np.ndarray, longest: int) -> None:
    changes = np.flatnonzero(np.diff(row)) + 1
    edges = np.concatenate([[0], changes, [row.size]])
    runs = np.diff(edges)
    if runs.max() > longest:
        start = edges[np.argmax(runs)]
        raise InputError(
            path,
            name,
            f"stuck at {row[start]:g} for {runs.max()} samples from sample {start}",
            "Check the sensor and its cable, or take it out of `sensors`",
        )


def _check_clipped(path: Path, name: str, row: np.ndarray) -> None:
    """A clipped signal piles up at its extreme: many samples, in runs, at one value.

    A quantised sinusoid has at most 2.5 times as many samples in its last step as in the one
    before (the arcsine law); 5 times in runs of three is the limiter's doing.
    """
    for extreme, side in ((row.max(), "top"), (row.min(), "bottom")):
        at = row == extreme
        count = int(np.count_nonzero(at))
        if count < 10 or not np.any(at[2:] & at[1:-1] & at[:-2]):
            continue
        rest = row[~at]
        neighbour = rest.max() if side == "top" else rest.min()
        if count > 5 * np.count_nonzero(rest == neighbour):
            raise InputError(
                path,
                name,
                f"clipped at the {side}: {count} samples at exactly {extreme:g}",
                "Record again with a larger range",
            )


def _check_units(recording: Recording, name: str, row: np.ndarray, rig: Rig) -> None:
    """Mean and ripple must be plausible beside the load pressure (sensors may be AC-coupled)."""
    load = recording.load_pressure
    mean, ripple = abs(float(np.mean(row))), float(np.std(row))
    if load is None:
        if rig.fluid.is_gas or ripple > 10:
            return
        problem = f"a ripple of {ripple:.3g} rms is implausible as Pa"
    elif mean > 3 * load + 1e6:
        problem = f"a mean of {mean:.3g} is implausible beside a load pressure of {load:.3g} Pa"
    elif ripple < 1e-4 * load and (mean < 10 * ripple or mean < load / 1000):
        problem = f"a ripple of {ripple:.3g} rms is implausible beside {load:.3g} Pa of load"
    elif mean > 10 * ripple and mean < load / 3 - 2e5:
        problem = f"a mean of {mean:.3g} is implausible beside a load pressure of {load:.3g} Pa"
    else:
        return
    unit = _unit_guess(mean, load)
    looks = f" and looks like {unit[0]}" if unit else ""
    multiply = f": multiply by {unit[1]:g}" if unit else ""
    remedy = f"Give pressure in Pa{multiply}; or correct load_pressure"
    raise InputError(recording.file, name, problem + looks, remedy)


def _unit_guess(mean: float, load: float | None) -> tuple[str, float] | None:
    units = (("bar", 1e5), ("MPa", 1e6), ("kPa", 1e3), ("psi", 6894.76))
    if load is None:
        return units[0]
    near = min(units, key=lambda unit: abs(np.log(max(mean, 1e-12) * unit[1] / load)))
    return near if 0.5 < mean * near[1] / load < 2 else None


def _check_speed(recording: Recording, rig: Rig) -> None:
    pistons = rig.pump["pistons"]
    found = estimate_speed(
        recording.pressure, recording.sampling_rate_hz, pistons, recording.speed_rpm
    )
    if found is None or abs(found / recording.speed_rpm - 1) > SPEED_TOLERANCE:
        reads = "no piston frequency" if found is None else f"{found:.5g} r/min"
        raise InputError(
            recording.file,
            "speed_rpm",
            f"{recording.speed_rpm:g} r/min with {pistons} pistons disagrees with the data, "
            f"which show {reads}",
            "Correct speed_rpm, pump.pistons or the sampling rate",
        )
