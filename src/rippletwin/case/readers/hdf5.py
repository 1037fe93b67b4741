"""HDF5: dataset `pressure`, in either orientation, Pa, with the attribute `sampling_rate_hz`.

The attribute may sit on the dataset, on its group or on the file, or be a dataset of one number.
Optional: attribute `sensors`, the channels' names; dataset `time_s` (samples,). rig.yaml may name
others.
"""

from __future__ import annotations

from pathlib import Path

import h5py

from rippletwin.case.readers.arrays import ArrayFile, read_arrays
from rippletwin.case.readers.hdf5_items import datasets_in, find_dataset, read_attribute
from rippletwin.case.readers.layout import Layout
from rippletwin.case.readers.signals import Signals
from rippletwin.errors import InputError


def read(path: Path, layout: Layout) -> Signals:
    """Read an HDF5 recording; raises InputError."""
    try:
        with h5py.File(path, "r") as file:
            return read_arrays(
                ArrayFile(
                    path,
                    lambda: datasets_in(file),
                    lambda name: find_dataset(path, file, name),
                    lambda beside, name: read_attribute(path, file, beside, name),
                ),
                layout,
            )
    except OSError as error:
        raise InputError(
            path,
            "file",
            f"cannot be read, is cut short or not HDF5 ({error})",
            "Copy it again from where it was recorded",
        ) from error
