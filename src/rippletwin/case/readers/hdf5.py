"""HDF5: dataset `pressure` (sensors, samples), Pa, attribute `sampling_rate_hz`.

The attribute may sit on the dataset or on the file. Optional: attribute `sensors`, the rows' names;
dataset `time_s` (samples,).
"""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np

from rippletwin.case.readers.hdf5_items import names_in, read_attribute, read_dataset
from rippletwin.case.readers.signals import Signals, one_number, rows_of
from rippletwin.errors import InputError


def read(path: Path, sensors: list[str]) -> Signals:
    """Read an HDF5 recording; raises InputError."""
    try:
        with h5py.File(path, "r") as file:
            found = read_dataset(path, file, "pressure")
            if found is None:
                raise InputError(
                    path,
                    "pressure",
                    f"no such dataset; the file has {', '.join(names_in(file)) or 'nothing'}",
                    "Store the recording as `pressure`, shape (sensors, samples), in Pa",
                )
            pressure, dataset = found
            names = read_attribute(path, (dataset, file), "sensors")
            rate = read_attribute(path, (dataset, file), "sampling_rate_hz")
            time = read_dataset(path, file, "time_s")
    except OSError as error:
        raise InputError(
            path,
            "file",
            f"cannot be read, is cut short or not HDF5 ({error})",
            "Copy it again from where it was recorded",
        ) from error
    if names is not None:
        names = [_text(name) for name in np.atleast_1d(names).ravel()]
    return Signals(
        pressure=rows_of(path, pressure, sensors, names),
        sampling_rate_hz=one_number(path, "sampling_rate_hz", rate),
        time_s=None if time is None else time[0],
    )


def _text(name) -> str:
    return name.decode("utf-8", "replace") if isinstance(name, bytes) else str(name)
