"""TDMS: one channel a sensor, named as the sensor, in whatever group, Pa.

The sampling rate comes from the channels' `wf_increment` property (s), or from a channel `time_s`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from nptdms import TdmsFile

from rippletwin.case.readers.file_checks import check_readable, check_size
from rippletwin.case.readers.signals import Signals, missing_sensor, numbers, one_number
from rippletwin.errors import InputError, raise_any

MAGIC = b"TDSm"  # the first bytes of every TDMS file


def read(path: Path, sensors: list[str]) -> Signals:
    """Read a TDMS recording; raises InputError."""
    if not check_readable(path).startswith(MAGIC):
        raise InputError(
            path,
            "file",
            "cannot be read: it does not begin as TDMS files do",
            "Copy it again from where it was recorded, or correct the suffix of its name",
        )
    try:
        with TdmsFile.open(path) as file:
            channels = [channel for group in file.groups() for channel in group.channels()]
            if not channels:
                raise ValueError("no channels")
            chosen = _choose(path, sensors, channels)
            rows = {name: _numbers(path, name, channel) for name, channel in chosen.items()}
            steps = {chosen[sensor].properties.get("wf_increment") for sensor in sensors}
    except InputError:
        raise
    except Exception as error:  # npTDMS raises many kinds for a damaged file
        raise InputError(
            path,
            "file",
            f"cannot be read, is cut short or not TDMS ({error})",
            "Copy it again from where it was recorded",
        ) from error
    if len({row.size for row in rows.values()}) > 1:
        sizes = ", ".join(f"{name} {row.size}" for name, row in rows.items())
        raise InputError(path, "channels", f"lengths differ: {sizes}", "Record them together")
    return Signals(
        pressure=np.array([rows[sensor] for sensor in sensors]),
        sampling_rate_hz=_rate(path, steps),
        time_s=rows.get("time_s"),
    )


def _choose(path: Path, sensors: list[str], channels: list) -> dict:
    """Channels of the sensors and of the time, by name."""
    by_name: dict[str, list] = {}
    for channel in channels:
        by_name.setdefault(channel.name, []).append(channel)
    raise_any(missing_sensor(path, s, by_name) for s in sensors if s not in by_name)
    for name in sensors:
        groups = [channel.group_name for channel in by_name[name]]
        if len(groups) > 1:
            problem = f"a channel in each of the groups {', '.join(groups)}"
            raise InputError(path, name, problem, "Save the group that is meant as its own file")
    wanted = [*sensors, *(["time_s"] if "time_s" in by_name else [])]
    return {name: by_name[name][0] for name in wanted}


def _numbers(path: Path, name: str, channel) -> np.ndarray:
    check_size(path, name, len(channel))
    return numbers(path, name, channel[:])


def _rate(path: Path, steps: set) -> float | None:
    """The sampling rate, Hz, of the channels' time steps."""
    if len(steps) > 1:
        raise InputError(
            path, "wf_increment", f"differs between sensors: {steps}", "Record them together"
        )
    step = one_number(path, "wf_increment", next(iter(steps), None))
    if not step:
        return None
    if not step > 0:
        raise InputError(path, "wf_increment", f"{step:g} s", "Give a positive time step")
    return 1 / step
