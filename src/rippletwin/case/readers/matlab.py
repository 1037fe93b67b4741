"""MATLAB .mat, v5 (scipy) and v7.3 (HDF5): `pressure` in either orientation, Pa.

Instead of `pressure` there may be one vector a sensor, named as the sensors. `sampling_rate_hz` is
a scalar; `time_s` a vector. A v7.3 file holds arrays with their dimensions reversed; they are read
as MATLAB shows them. A field of a struct is named with a point: rec.pressure.
"""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import scipy.io
from scipy.io.matlab import matfile_version

from rippletwin.case.readers.arrays import ArrayFile, read_arrays
from rippletwin.case.readers.file_checks import check_size, refuse_damaged
from rippletwin.case.readers.hdf5_items import datasets_in, find_dataset
from rippletwin.case.readers.layout import Layout
from rippletwin.case.readers.signals import Signals, numbers
from rippletwin.errors import InputError

STRUCTS = ("struct", "object")


def read(path: Path, layout: Layout) -> Signals:
    """Read a MATLAB recording; raises InputError."""
    again = "Save it again from MATLAB: save(file, 'pressure', 'sampling_rate_hz')"
    with refuse_damaged(path, "is cut short or not a MATLAB file", again):
        if h5py.is_hdf5(path):
            return _read_v73(path, layout)
        if matfile_version(path)[0] == 0:
            # its headers are four numbers that nothing checks: what they claim would be allocated
            raise InputError(path, "file", "of MATLAB's version 4, or damaged", again)
        return _read_v5(path, layout)


def _read_v5(path: Path, layout: Layout) -> Signals:
    """A file of v5 to v7."""
    variables = {name: (shape, kind) for name, shape, kind in scipy.io.whosmat(path)}
    loaded: dict[str, object] = {}

    def array(name: str) -> np.ndarray | None:
        variable, *fields = name.split(".")
        if variable not in variables:
            return None
        shape, _ = variables[variable]
        check_size(path, name, int(np.prod([float(n) for n in shape])))
        if variable not in loaded:
            options = {"variable_names": [variable], "struct_as_record": False}
            loaded[variable] = scipy.io.loadmat(path, squeeze_me=bool(fields), **options)[variable]
        value = loaded[variable]
        for field in fields:
            value = getattr(value, field, None)
        return None if value is None else numbers(path, name, value)

    def present() -> list[str]:
        kinds = {name: kind for name, (_, kind) in variables.items()}
        plain = [name for name, kind in kinds.items() if kind not in STRUCTS]
        structs = [name for name, kind in kinds.items() if kind in STRUCTS]
        return plain + [f"{name}.{field}" for name in structs for field in _fields_of(path, name)]

    return read_arrays(ArrayFile(path, present, array, _no_attribute, "."), layout)


def _fields_of(path: Path, struct: str) -> list[str]:
    options = {"variable_names": [struct], "struct_as_record": False, "squeeze_me": True}
    return list(getattr(scipy.io.loadmat(path, **options)[struct], "_fieldnames", ()))


def _read_v73(path: Path, layout: Layout) -> Signals:
    """A file of v7.3, which is HDF5."""

    def array(name: str) -> Reversed | None:
        dataset = find_dataset(path, file, name.replace(".", "/"))
        return None if dataset is None else Reversed(dataset)

    with h5py.File(path, "r") as file:
        return read_arrays(
            ArrayFile(
                path,
                lambda: [name.replace("/", ".") for name in datasets_in(file)],
                array,
                _no_attribute,
                ".",
            ),
            layout,
        )


class Reversed:
    """A dataset with its dimensions in reverse order; what is indexed is read."""

    def __init__(self, dataset: h5py.Dataset):
        self._dataset, self.shape = dataset, dataset.shape[::-1]

    def __getitem__(self, index) -> np.ndarray:
        index = () if index is Ellipsis else index if isinstance(index, tuple) else (index,)
        rest = (slice(None),) * (len(self.shape) - len(index))
        return self._dataset[(*index, *rest)[::-1]].T


def _no_attribute(beside: str, name: str) -> None:
    """MATLAB's variables have no attributes."""
