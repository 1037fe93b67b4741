"""HDF5: dataset `pressure`, in either orientation, Pa, with the attribute `sampling_rate_hz`.

The attribute may sit on the dataset, on its group or on the file, or be a dataset of one number.
Optional: attribute `sensors`, the channels' names; dataset `time_s` (samples,). rig.yaml may name
others.
"""

from __future__ import annotations

from pathlib import Path

import h5py

from rippletwin.case.readers.arrays import ArrayFile, read_arrays
from rippletwin.case.readers.file_checks import refuse_damaged
from rippletwin.case.readers.hdf5_items import datasets_in, find_dataset, read_attribute
from rippletwin.case.readers.layout import Layout
from rippletwin.case.readers.signals import Signals


def read(path: Path, layout: Layout) -> Signals:
    """Read an HDF5 recording; raises InputError."""
    with refuse_damaged(path, "is cut short or not HDF5"), h5py.File(path, "r") as file:
        return read_arrays(
            ArrayFile(
                path,
                lambda: datasets_in(file),
                lambda name: find_dataset(path, file, name),
                lambda beside, name: read_attribute(path, file, beside, name),
            ),
            layout,
        )
