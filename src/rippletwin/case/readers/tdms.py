"""TDMS: one channel a sensor, named as the sensor or as rig.yaml says, in whatever group, Pa.

The sampling rate comes from the channels' `wf_increment` property (s), from a property that
rig.yaml names, or from a channel `time_s`. `dataset` of rig.yaml is the group.
"""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np
from nptdms import TdmsFile
from nptdms.log import log_manager

from rippletwin.case.readers.file_checks import (
    BoundedFile,
    check_readable,
    check_size,
    refuse_damaged,
)
from rippletwin.case.readers.layout import Layout, choose, find_time, missing_name
from rippletwin.case.readers.signals import Signals, numbers, one_number
from rippletwin.errors import InputError

MAGIC = b"TDSm"  # the first bytes of every TDMS file

log_manager.set_level(logging.ERROR)  # a file that lacks something is refused here, in one sentence


def read(path: Path, layout: Layout) -> Signals:
    """Read a TDMS recording; raises InputError."""
    if not check_readable(path).startswith(MAGIC):
        raise InputError(
            path,
            "file",
            "cannot be read: it does not begin as TDMS files do",
            "Copy it again from where it was recorded, or correct the suffix of its name",
        )
    damaged = refuse_damaged(path, "is cut short or not TDMS")
    with damaged, BoundedFile(path) as bytes_of_file, TdmsFile.open(bytes_of_file) as file:
        channels = _channels(path, file, layout)
        names = [channel.name for channel in channels]
        chosen = [channels[k] for k in choose(path, layout, names)]
        time = find_time(path, layout, names)
        rows = [_numbers(path, s, c) for s, c in zip(layout.sensors, chosen)]
        time_s = None if time is None else _numbers(path, layout.time_name, channels[time])
        rate = _rate(path, layout, [{**file.properties, **c.properties} for c in chosen])
    if len({row.size for row in rows}) > 1:
        sizes = ", ".join(f"{s} {row.size}" for s, row in zip(layout.sensors, rows))
        raise InputError(path, "channels", f"lengths differ: {sizes}", "Record them together")
    return Signals(pressure=np.array(rows), sampling_rate_hz=rate, time_s=time_s)


def _channels(path: Path, file: TdmsFile, layout: Layout) -> list:
    """The channels of the group that rig.yaml names, or of all groups."""
    groups = {group.name: group for group in file.groups()}
    if layout.dataset is not None:
        if layout.dataset not in groups:
            raise missing_name(path, "dataset", layout.dataset, groups)
        return groups[layout.dataset].channels()
    channels = [channel for group in groups.values() for channel in group.channels()]
    if not channels:
        raise ValueError("no channels")
    for name in layout.names:
        holders = [channel.group_name for channel in channels if channel.name == name]
        if len(holders) > 1:
            problem = f"a channel in each of the groups {', '.join(holders)}"
            remedy = f"Say which group is meant, in rig.yaml: dataset: {holders[0]}"
            raise InputError(path, name, problem, remedy)
    return channels


def _numbers(path: Path, name: str, channel) -> np.ndarray:
    check_size(path, name, len(channel))
    return numbers(path, name, channel[:])


def _rate(path: Path, layout: Layout, properties: list[dict]) -> float | None:
    """The sampling rate, Hz: the property that rig.yaml names, or that of the time steps."""
    name = layout.rate or "wf_increment"
    values = {of_channel.get(name) for of_channel in properties}
    if len(values) > 1:
        raise InputError(path, name, f"differs between sensors: {values}", "Record them together")
    value = one_number(path, name, next(iter(values)))
    if layout.rate is not None:
        if value is None:
            raise missing_name(path, "sampling_rate_name", name, properties[0])
        return value
    if not value:
        return None
    if not value > 0:
        raise InputError(path, name, f"{value:g} s", "Give a positive time step")
    return 1 / value
