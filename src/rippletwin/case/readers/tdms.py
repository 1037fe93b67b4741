"""TDMS: one channel a sensor, named as the sensor, in whatever group, Pa.

The sampling rate comes from the channels' `wf_increment` property (s), or from a channel `time_s`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from nptdms import TdmsFile

from rippletwin.case.readers.signals import Signals, missing_sensor, numbers
from rippletwin.errors import InputError


def read(path: Path, sensors: list[str]) -> Signals:
    """Read a TDMS recording; raises InputError."""
    try:
        with TdmsFile.open(path) as file:
            channels = {
                channel.name: channel for group in file.groups() for channel in group.channels()
            }
            for sensor in sensors:
                if sensor not in channels:
                    raise missing_sensor(path, sensor, channels)
            rows = [numbers(path, sensor, channels[sensor][:]) for sensor in sensors]
            time = numbers(path, "time_s", channels["time_s"][:]) if "time_s" in channels else None
            step = channels[sensors[0]].properties.get("wf_increment")
    except InputError:
        raise
    except Exception as error:  # npTDMS raises many kinds for a damaged file
        raise InputError(
            path,
            "file",
            f"cannot be read, is cut short or not TDMS ({error})",
            "Copy it again from where it was recorded",
        ) from error
    if len({row.size for row in rows}) > 1:
        sizes = ", ".join(f"{name} {row.size}" for name, row in zip(sensors, rows))
        raise InputError(path, "channels", f"lengths differ: {sizes}", "Record them together")
    return Signals(
        pressure=np.array(rows),
        sampling_rate_hz=1 / float(step) if step else None,
        time_s=time,
    )
