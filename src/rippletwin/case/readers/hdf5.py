"""HDF5: dataset `pressure` (sensors, samples), Pa, attribute `sampling_rate_hz`.

The attribute may sit on the dataset or on the file. Optional: attribute `sensors`, the rows' names;
dataset `time_s` (samples,).
"""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np

from rippletwin.case.readers.signals import Signals, numbers, rows_of
from rippletwin.errors import InputError


def read(path: Path, sensors: list[str]) -> Signals:
    """Read an HDF5 recording; raises InputError."""
    try:
        with h5py.File(path, "r") as file:
            if "pressure" not in file:
                raise InputError(
                    path,
                    "pressure",
                    f"no such dataset; the file has {', '.join(file) or 'nothing'}",
                    "Store the recording as `pressure`, shape (sensors, samples), in Pa",
                )
            dataset = file["pressure"]
            pressure = numbers(path, "pressure", dataset[()])
            attributes = {**file.attrs, **dataset.attrs}
            time = numbers(path, "time_s", file["time_s"][()]) if "time_s" in file else None
    except OSError as error:
        raise InputError(
            path,
            "file",
            f"cannot be read, is cut short or not HDF5 ({error})",
            "Copy it again from where it was recorded",
        ) from error
    names = attributes.get("sensors")
    if names is not None:
        names = [n.decode() if isinstance(n, bytes) else str(n) for n in np.atleast_1d(names)]
    rate = attributes.get("sampling_rate_hz")
    return Signals(
        pressure=rows_of(path, pressure, sensors, names),
        sampling_rate_hz=None if rate is None else float(np.squeeze(rate)),
        time_s=time,
    )
