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

from rippletwin.case.readers.file_checks import check_size
from rippletwin.case.readers.hdf5_items import names_in, read_dataset
from rippletwin.case.readers.signals import Signals, missing_sensor, numbers, one_number, rows_of
from rippletwin.errors import InputError, raise_any

UNPACK = "Save its fields by themselves, from MATLAB: save(file, '-struct', '{}')"


def read(path: Path, sensors: list[str]) -> Signals:
    """Read a MATLAB recording; raises InputError."""
    wanted = ["pressure", "sampling_rate_hz", "time_s", *sensors]
    try:
        read_variables = _read_v73 if h5py.is_hdf5(path) else _read_v5
        found, structs, present = read_variables(path, wanted)
    except InputError:
        raise
    except Exception as error:  # scipy raises a dozen kinds for a damaged file
        raise InputError(
            path,
            "file",
            f"cannot be read, is cut short or not a MATLAB file ({error})",
            "Save it again from MATLAB: save(file, 'pressure', 'sampling_rate_hz')",
        ) from error
    if structs and "pressure" not in found and not all(sensor in found for sensor in sensors):
        raise InputError(
            path,
            "pressure",
            f"not among the variables {', '.join(present)}; it may be inside the struct "
            f"{structs[0]}",
            UNPACK.format(structs[0]),
        )
    time = found.get("time_s")
    return Signals(
        pressure=_pressure(path, found, sensors, present),
        sampling_rate_hz=one_number(path, "sampling_rate_hz", found.get("sampling_rate_hz")),
        time_s=None if time is None else time.ravel(),
    )


def _read_v5(path: Path, wanted: list[str]) -> tuple[dict, list[str], list[str]]:
    """The wanted variables, the names of structs, and all names of a v5 (or older) file."""
    variables = scipy.io.whosmat(path)
    for name, shape, _ in variables:
        if name in wanted:
            check_size(path, name, int(np.prod([float(n) for n in shape])))
    loaded = scipy.io.loadmat(path, variable_names=wanted)
    found = {name: numbers(path, name, loaded[name]) for name in wanted if name in loaded}
    structs = [name for name, _, kind in variables if kind in ("struct", "object", "cell")]
    return found, structs, [name for name, _, _ in variables]


def _read_v73(path: Path, wanted: list[str]) -> tuple[dict, list[str], list[str]]:
    """The same of a v7.3 file."""
    with h5py.File(path, "r") as file:
        present = names_in(file)
        read = {name: read_dataset(path, file, name) for name in wanted}
        structs = [name for name in present if isinstance(file.get(name), h5py.Group)]
    return {name: item[0] for name, item in read.items() if item is not None}, structs, present


def _pressure(path: Path, found: dict, sensors: list[str], present: list[str]) -> np.ndarray:
    if "pressure" in found:
        pressure = np.atleast_2d(found["pressure"])
        if pressure.ndim == 2 and pressure.shape[0] > pressure.shape[1]:
            pressure = np.ascontiguousarray(pressure.T)
        return rows_of(path, pressure, sensors, None)
    raise_any(missing_sensor(path, sensor, present) for sensor in sensors if sensor not in found)
    lengths = {sensor: found[sensor].size for sensor in sensors}
    if len(set(lengths.values())) > 1:
        raise InputError(
            path, ", ".join(sensors), f"lengths {lengths} differ", "One sample of each at a time"
        )
    return np.array([found[sensor].ravel() for sensor in sensors])
