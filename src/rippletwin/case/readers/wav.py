"""WAV: channels in the order of the sensors, or by number; the sampling rate is in the file.

Whole numbers are the recorder's raw counts, which `scale` in rig.yaml makes a pressure. A sample
with fewer bits than its bytes hold has them in the upper part. Its header says how many they are,
so that the size of a count does not depend on what was recorded.
"""

from __future__ import annotations

import struct
import warnings
from pathlib import Path
from typing import BinaryIO

from scipy.io import wavfile

from rippletwin.case.readers.file_checks import BoundedFile, check_size, refuse_damaged
from rippletwin.case.readers.layout import SAMPLES_BY_SENSORS, Layout, rows_of
from rippletwin.case.readers.signals import Signals, numbers
from rippletwin.errors import InputError

BYTES_OF_24_BITS = 3
EXTENSIBLE = 0xFFFE  # the format with valid bits of its own
FORMAT_HEAD, EXTENSION, RIFF_HEAD = 16, 4, 12  # bytes


def read(path: Path, layout: Layout) -> Signals:
    """Read a WAV recording; raises InputError."""
    check_size(path, "file", path.stat().st_size // BYTES_OF_24_BITS)
    with refuse_damaged(path, "is cut short or not WAV"), warnings.catch_warnings():
        warnings.simplefilter("ignore", wavfile.WavFileWarning)  # chunks of other programs
        with BoundedFile(path) as file:
            rate, values = wavfile.read(file)
            bits = read_bits(file)
    if not values.size:
        raise InputError(path, "file", "no samples", "Copy it again from where it was recorded")
    counts = values.dtype.kind in "iu"
    unused = 8 * values.dtype.itemsize - bits if counts else 0
    values = numbers(path, "channels", values)
    if unused > 0:
        values = values / 2**unused
    stated = Layout(layout.sensors, None, SAMPLES_BY_SENSORS, layout.channels)
    channels = values[:, None] if values.ndim == 1 else values
    rows = rows_of(path, "channels", channels, stated, None)
    return Signals(pressure=rows, sampling_rate_hz=float(rate), counts=counts)


def read_bits(file: BinaryIO) -> int:
    """Bits of a sample that the header of a WAV file states; of an extensible format the valid
    ones. Raises struct.error where there is no header."""
    file.seek(0)
    order = ">" if file.read(RIFF_HEAD).startswith(b"RIFX") else "<"
    name, size = struct.unpack(f"{order}4sI", file.read(8))
    while name != b"fmt ":
        file.seek(size + size % 2, 1)
        name, size = struct.unpack(f"{order}4sI", file.read(8))
    tag, bits = struct.unpack(f"{order}H12xH", file.read(FORMAT_HEAD))
    if tag == EXTENSIBLE and size >= FORMAT_HEAD + EXTENSION:
        valid = struct.unpack(f"{order}2xH", file.read(EXTENSION))[0]
        bits = min(valid, bits) or bits  # some programs state no valid bits
    return bits
