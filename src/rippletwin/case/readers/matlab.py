"""MATLAB .mat, v5 (scipy) and v7.3 (HDF5): `pressure` (sensors, samples) or its transpose, Pa.

Instead of `pressure` there may be one vector a sensor, named as the sensors. `sampling_rate_hz` is
a scalar; `time_s` a vector. A v7.3 file stores arrays transposed; both orders are understood, for
the sensors are fewer than the samples.
"""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import scipy.io

from rippletwin.case.readers.signals import Signals, missing_sensor, numbers, rows_of
from rippletwin.errors import InputError


def read(path: Path, sensors: list[str]) -> Signals:
    """Read a MATLAB recording; raises InputError."""
    wanted = ["pressure", "sampling_rate_hz", "time_s", *sensors]
    try:
        if h5py.is_hdf5(path):
            with h5py.File(path, "r") as file:
                present = [name for name in file if not name.startswith("#")]
                found = {name: file[name][()] for name in wanted if name in file}
        else:
            present = [name for name, _, _ in scipy.io.whosmat(path)]
            loaded = scipy.io.loadmat(path, variable_names=wanted)
            found = {name: loaded[name] for name in wanted if name in loaded}
    except Exception as error:  # scipy raises a dozen kinds for a damaged file
        raise InputError(
            path,
            "file",
            f"cannot be read, is cut short or not a MATLAB file ({error})",
            "Save it again from MATLAB: save(file, 'pressure', 'sampling_rate_hz')",
        ) from error
    found = {name: numbers(path, name, value) for name, value in found.items()}
    rate, time = found.get("sampling_rate_hz"), found.get("time_s")
    return Signals(
        pressure=_pressure(path, found, sensors, present),
        sampling_rate_hz=None if rate is None else float(np.squeeze(rate)),
        time_s=None if time is None else time.ravel(),
    )


def _pressure(path: Path, found: dict, sensors: list[str], present: list[str]) -> np.ndarray:
    if "pressure" in found:
        pressure = np.atleast_2d(found["pressure"])
        if pressure.ndim == 2 and pressure.shape[0] > pressure.shape[1]:
            pressure = np.ascontiguousarray(pressure.T)
        return rows_of(path, pressure, sensors, None)
    for sensor in sensors:
        if sensor not in found:
            raise missing_sensor(path, sensor, present)
    lengths = {sensor: found[sensor].size for sensor in sensors}
    if len(set(lengths.values())) > 1:
        raise InputError(
            path, ", ".join(sensors), f"lengths {lengths} differ", "One sample of each at a time"
        )
    return np.array([found[sensor].ravel() for sensor in sensors])
