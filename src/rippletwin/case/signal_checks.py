"""Checks of a sampled recording: each failure names file, field, problem and remedy."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from rippletwin.case.model import Recording, Rig
from rippletwin.case.pressure_units import unit_error
from rippletwin.case.readers.signals import Signals
from rippletwin.case.speed_estimate import estimate_speed
from rippletwin.errors import InputError

FEWEST_REVOLUTIONS = 4
TIME_COLUMN = "the time column"  # as who says a sampling rate
RATE_TOLERANCE = 1e-3
SPEED_TOLERANCE = 0.01
LONGEST_FLAT_S = 0.02  # for random recordings; periodic ones use the piston period
RATES_HZ = (100.0, 2e7)  # from slow gas lines to the fastest recorders
RATE_OVER_PISTON_FREQUENCY = 2.5  # spectra end at 0.4 times the sampling rate


def sampling_rate(path: Path, signals: Signals, stated: float | None) -> float:
    """The sampling rate (Hz) that file, time column and sheet agree on; raises InputError."""
    from_time = None if signals.time_s is None else _rate_of_time(path, signals)
    claims = [
        (claim, rate)
        for claim, rate in (
            ("the file's sampling_rate_hz", signals.sampling_rate_hz),
            ("rig.yaml's sampling_rate_hz", stated),
            (TIME_COLUMN, from_time),
        )
        if rate is not None
    ]
    if not claims:
        raise InputError(
            path,
            "sampling_rate_hz",
            "missing",
            "Say where the file has it, time: NAME (times in seconds) or sampling_rate_name: NAME, "
            "or give sampling_rate_hz for this recording in rig.yaml",
        )
    for claim, rate in claims:
        if not RATES_HZ[0] <= rate <= RATES_HZ[1]:
            looks, remedy = "kHz", "Give samples a second, Hz"
            if claim == TIME_COLUMN:
                looks = "times in ms"
                remedy = "Give times in seconds, or leave them out and give sampling_rate_hz"
            is_thousandth = RATES_HZ[0] <= 1000 * rate <= 1e6
            raise InputError(
                path,
                "sampling_rate_hz",
                f"{claim} says {rate:g} Hz, an implausible sampling rate"
                + (f"; it looks like {looks}" if is_thousandth else ""),
                remedy,
            )
    rates = [rate for _, rate in claims]
    if max(rates) - min(rates) > RATE_TOLERANCE * max(rates):
        said = " but ".join(f"{claim} says {rate:.6g} Hz" for claim, rate in claims)
        raise InputError(path, "sampling_rate_hz", said, "Correct the wrong one")
    return claims[0][1]


def _rate_of_time(path: Path, signals: Signals) -> float:
    time, samples = signals.time_s.ravel().astype(float), signals.pressure.shape[1]
    if time.size != samples:
        raise InputError(
            path, "time_s", f"{time.size} times for {samples} samples", "One time a sample"
        )
    if samples < 2:
        raise InputError(path, "time_s", f"{samples} row(s) only", "Export the whole recording")
    bad = np.flatnonzero(~np.isfinite(time))
    if bad.size:
        raise InputError(
            path, "time_s", f"no finite number in row {bad[0] + 1}", "Correct or export it again"
        )
    step = (time[-1] - time[0]) / (samples - 1)
    if not step > 0:
        problem = f"runs from {time[0]:g} to {time[-1]:g} s, not forward"
        raise InputError(path, "time_s", problem, "Time is in seconds and rises from row to row")
    rounding = float(np.spacing(np.max(np.abs(signals.time_s))))
    if rounding > step:  # a sample that was dropped could not be told
        kind = "single" if signals.time_s.dtype == np.float32 else "double"
        raise InputError(
            path,
            "time_s",
            f"{kind} precision rounds the times to {rounding:.2g} s, more than a step of "
            f"{step:.2g} s",
            "Store double precision from 0 s on, or leave time_s out and give sampling_rate_hz",
        )
    usual = np.median(np.diff(time))
    off = np.abs(time - time[0] - step * np.arange(samples)) > 0.5 * step + rounding
    if np.any(off):
        if np.any(np.diff(time) == 0.0):
            raise InputError(
                path,
                "time_s",
                f"times repeat: they are rounded to more than a step of {step:.2g} s",
                "Export them with more digits, or leave them out and give sampling_rate_hz",
            )
        row = int(np.argmax(np.abs(np.diff(time) - usual) > 0.5 * abs(usual) + rounding)) + 2
        raise InputError(
            path,
            "time_s",
            f"not evenly spaced (first at row {row})",
            "Samples were dropped or the clock jumped: export one unbroken stretch",
        )
    return float(1 / step)


def signal_errors(recording: Recording, rig: Rig) -> list[InputError]:
    """Everything in a sampled recording that is not as a pressure ripple is."""
    path, pressure = recording.file, recording.pressure
    rows = [(sensor.name, row) for sensor, row in zip(rig.sensors, pressure)]
    # what follows is decided by what precedes: gaps make everything else meaningless
    for check in (
        lambda: [_gaps(path, name, row) for name, row in rows],
        lambda: [_length_error(recording, rig)],
        lambda: list(_shape_errors(recording, rig, rows)),
        lambda: [_speed_error(recording, rig)] if _tells_speed(recording) else [],
    ):
        errors = [error for error in check() if error is not None]
        if errors:
            return errors
    return []


def _gaps(path: Path, name: str, row: np.ndarray) -> InputError | None:
    bad = np.flatnonzero(~np.isfinite(row))
    if not bad.size:
        return None
    return InputError(
        path,
        name,
        f"{bad.size} of {row.size} samples are not numbers (NaN), the first at {bad[0]}",
        "Cut the recording to an unbroken stretch; gaps cannot be filled in",
    )


def _length_error(recording: Recording, rig: Rig) -> InputError | None:
    """What is wrong with the number of samples, or of samples a second."""
    path, samples, rate = recording.file, recording.pressure.shape[1], recording.sampling_rate_hz
    if recording.kind == "random":
        few = samples < 1024
        remedy = "Record at least 1024"
        return InputError(path, "pressure", f"{samples} samples only", remedy) if few else None
    revolutions = samples / rate * recording.speed_rpm / 60
    if revolutions < FEWEST_REVOLUTIONS:
        return InputError(
            path,
            "pressure",
            f"{revolutions:.1f} revolutions at {recording.speed_rpm:g} r/min are too few",
            f"Record at least {FEWEST_REVOLUTIONS}, better 100, or correct speed_rpm",
        )
    piston_hz = rig.pump["pistons"] * recording.speed_rpm / 60
    if rate < RATE_OVER_PISTON_FREQUENCY * piston_hz:
        return InputError(
            path,
            "sampling_rate_hz",
            f"{rate:g} Hz is too low for pistons at {piston_hz:.4g} Hz",
            "Record at ten times the piston frequency and more, or correct speed_rpm, or times "
            "that are not in seconds",
        )
    return None


def _shape_errors(recording: Recording, rig: Rig, rows) -> Iterator[InputError | None]:
    """The first fault of each sensor: stuck, clipped, or no pascals."""
    longest = _longest_flat(recording, rig)
    for name, row in rows:
        yield (
            _stuck(recording.file, name, row, longest)
            or _clipped(recording.file, name, row)
            or unit_error(recording, rig, name, row)
        )


def _longest_flat(recording: Recording, rig: Rig) -> int:
    seconds = LONGEST_FLAT_S
    if recording.kind == "periodic":
        seconds = 60 / recording.speed_rpm / rig.pump["pistons"]
    return max(int(seconds * recording.sampling_rate_hz), 32)


def _stuck(path: Path, name: str, row: np.ndarray, longest: int) -> InputError | None:
    start, length = longest_run(row, longest)
    if length <= longest:
        return None
    return InputError(
        path,
        name,
        f"stuck at {row[start]:g} for {length} samples from sample {start}",
        "Check the sensor and its cable, or take it out of `sensors`",
    )


def longest_run(row: np.ndarray, shortest: int) -> tuple[int, int]:
    """(first sample, length) of the longest run of one value; (0, 0) where none exceeds `shortest`.

    Such a run holds two neighbours of every grid that is at most half as wide. Only where these are
    equal is every sample between them compared.
    """
    step = max(shortest // 2, 1)
    points = row[::step]
    best = (0, 0)
    for k in np.flatnonzero(points[1:] == points[:-1]):
        if k * step < best[0] + best[1] or not np.all(row[k * step : (k + 1) * step] == points[k]):
            continue
        start, end = _first_other(row[: k * step][::-1], points[k]), k * step
        length = start + _first_other(row[end:], points[k])
        if length > max(best[1], shortest):
            best = (int(end - start), int(length))
    return best


def _first_other(row: np.ndarray, value: float) -> int:
    """How many samples at the beginning of `row` have this value."""
    size = 1024
    while True:
        other = np.flatnonzero(row[:size] != value)
        if other.size:
            return int(other[0])
        if size >= len(row):
            return len(row)
        size *= 4


def _clipped(path: Path, name: str, row: np.ndarray) -> InputError | None:
    """A clipped signal piles up at its extreme: many samples, in runs, at one value.

    A quantised sinusoid has at most 2.5 times as many samples in its last step as in the one
    before (the arcsine law); 5 times in runs of three is the limiter's doing.
    """
    for extreme, side in ((row.max(), "top"), (row.min(), "bottom")):
        at = row == extreme
        count = int(np.count_nonzero(at))
        if count < 10 or not np.any(at[2:] & at[1:-1] & at[:-2]):
            continue
        if side == "top":
            neighbour = np.max(row, where=~at, initial=-np.inf)
        else:
            neighbour = np.min(row, where=~at, initial=np.inf)
        if count > 5 * np.count_nonzero(row == neighbour):
            return InputError(
                path,
                name,
                f"clipped at the {side}: {count} samples at exactly {extreme:g}",
                "Record again with a larger range",
            )
    return None


def _tells_speed(recording: Recording) -> bool:
    """Whether the ripple is that of equal pistons: a fault can make shaft orders that are stronger
    than those of the pistons, which then look like another speed."""
    return recording.kind == "periodic" and recording.state == "healthy"


def _speed_error(recording: Recording, rig: Rig) -> InputError | None:
    pistons = rig.pump["pistons"]
    found = estimate_speed(
        recording.pressure, recording.sampling_rate_hz, pistons, recording.speed_rpm
    )
    if found is not None and abs(found / recording.speed_rpm - 1) <= SPEED_TOLERANCE:
        return None
    reads = "no piston frequency" if found is None else f"{found:.5g} r/min"
    return InputError(
        recording.file,
        "speed_rpm",
        f"{recording.speed_rpm:g} r/min with {pistons} pistons disagrees with the data, "
        f"which show {reads}",
        "Correct speed_rpm, pump.pistons or the sampling rate",
    )
