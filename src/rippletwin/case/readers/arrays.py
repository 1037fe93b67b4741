"""Formats that hold named arrays (HDF5, MATLAB, zarr): which of them are the sensors' signals."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rippletwin.case.readers.file_checks import check_size
from rippletwin.case.readers.layout import (
    ArrayLike,
    Layout,
    missing_name,
    missing_sensor,
    rows_of,
    similar_name,
)
from rippletwin.case.readers.signals import Signals, numbers, one_number
from rippletwin.errors import InputError, raise_any


@dataclass(frozen=True)
class ArrayFile:
    """An open file of named arrays.

    present    names of what it holds, for messages; asked for only where something is missing
    array      name -> an array that is read when it is indexed, None where there is none of that
               name
    attribute  (array's name, attribute's name) -> value, None where there is none
    separator  between the parts of a nested name
    """

    path: Path
    present: Callable[[], Sequence[str]]
    array: Callable[[str], ArrayLike | None]
    attribute: Callable[[str, str], object]
    separator: str = "/"


def read_arrays(file: ArrayFile, layout: Layout) -> Signals:
    """The signals in a file of arrays: one array of all sensors, or one vector for each of them."""
    name = layout.dataset or "pressure"
    array = file.array(name)
    if array is not None:
        names = file.attribute(name, "sensors")
        names = None if names is None else [_text(one) for one in np.ravel(np.asarray(names))]
        pressure = rows_of(file.path, name, array, layout, names)
    elif layout.dataset is not None:
        raise missing_name(file.path, "dataset", name, file.present())
    else:
        pressure, name = _vectors(file, layout), str(layout.channel(layout.sensors[0]))
    time = _beside(file, name, layout.time_name)
    if time is None and layout.time is not None:
        raise missing_name(file.path, "time", layout.time, file.present())
    return Signals(
        pressure=pressure,
        sampling_rate_hz=_rate(file, layout, name),
        time_s=time,
    )


def _vectors(file: ArrayFile, layout: Layout) -> np.ndarray:
    """The sensors' own vectors as rows (S, N)."""
    found = {s: file.array(str(layout.channel(s))) for s in layout.sensors}
    missing = [sensor for sensor, vector in found.items() if vector is None]
    if missing:
        present = list(file.present())
        near = any(similar_name(str(layout.channel(s)), present) for s in missing)
        if len(missing) == len(found) and not near:
            raise InputError(
                file.path,
                "pressure",
                f"no such array; the file has {', '.join(present) or 'nothing'}",
                "Say in rig.yaml which one holds the pressure: dataset: "
                f"{present[0] if present else 'NAME'}",
            )
        raise_any(missing_sensor(file.path, layout, sensor, present) for sensor in missing)
    lengths = {sensor: int(np.prod(vector.shape)) for sensor, vector in found.items()}
    if len(set(lengths.values())) > 1:
        problem = f"lengths {lengths} differ"
        remedy = "One sample of each at a time"
        raise InputError(file.path, ", ".join(layout.sensors), problem, remedy)
    return np.array([_whole(file.path, s, vector) for s, vector in found.items()])


def _rate(file: ArrayFile, layout: Layout, beside: str) -> float | None:
    """The sampling rate that the file states, as an attribute or as an array of one number."""
    value = file.attribute(beside, layout.rate_name)
    if value is None:
        value = _beside(file, beside, layout.rate_name)
    if value is None and layout.rate is not None:
        raise missing_name(file.path, "sampling_rate_name", layout.rate, file.present())
    return one_number(file.path, layout.rate_name, value)


def _beside(file: ArrayFile, name: str, other: str) -> np.ndarray | None:
    """The values of `other` in the group of the array `name`, or at the top of the file."""
    group = name.rpartition(file.separator)[0]
    found = file.array(f"{group}{file.separator}{other}") if group else None
    found = file.array(other) if found is None else found
    return None if found is None else _whole(file.path, other, found)


def _whole(path: Path, name: str, array: ArrayLike) -> np.ndarray:
    """All values of an array, in one row."""
    check_size(path, name, int(np.prod([float(n) for n in array.shape])))
    return numbers(path, name, array[...]).ravel()


def _text(name) -> str:
    return name.decode("utf-8", "replace") if isinstance(name, bytes) else str(name)
