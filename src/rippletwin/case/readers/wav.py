"""WAV: channels in the order of the sensors, or by number; the sampling rate is in the file.

Whole numbers are the recorder's raw counts, which `scale` in rig.yaml makes a pressure.
"""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
from scipy.io import wavfile

from rippletwin.case.readers.file_checks import BoundedFile, check_size, refuse_damaged
from rippletwin.case.readers.layout import SAMPLES_BY_SENSORS, Layout, rows_of
from rippletwin.case.readers.signals import Signals, numbers
from rippletwin.errors import InputError

BYTES_OF_24_BITS = 3
LOW_BYTE = 256  # scipy puts 24 bits into the upper part of 32


def read(path: Path, layout: Layout) -> Signals:
    """Read a WAV recording; raises InputError."""
    check_size(path, "file", path.stat().st_size // BYTES_OF_24_BITS)
    with refuse_damaged(path, "is cut short or not WAV"), warnings.catch_warnings():
        warnings.simplefilter("ignore", wavfile.WavFileWarning)  # chunks of other programs
        with BoundedFile(path) as file:
            rate, values = wavfile.read(file)
    if not values.size:
        raise InputError(path, "file", "no samples", "Copy it again from where it was recorded")
    if values.dtype == np.int32 and not np.any(values % LOW_BYTE):
        values = values // LOW_BYTE
    values = numbers(path, "channels", values)
    stated = Layout(layout.sensors, None, SAMPLES_BY_SENSORS, layout.channels)
    channels = values[:, None] if values.ndim == 1 else values
    return Signals(
        pressure=rows_of(path, "channels", channels, stated, None), sampling_rate_hz=float(rate)
    )
