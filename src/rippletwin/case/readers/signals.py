"""What every reader returns, and the questions of type and shape that readers share."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rippletwin.errors import InputError, raise_any


@dataclass(frozen=True)
class Signals:
    """Pressure (S, N) in the rig's sensor order, with whatever the file says of its time axis."""

    pressure: np.ndarray
    sampling_rate_hz: float | None = None
    time_s: np.ndarray | None = None


def numbers(path: Path, field: str, values) -> np.ndarray:
    """`values` as floats: single precision and 16 bits become single, all else double precision.

    Raises InputError where they are not real numbers.
    """
    array = np.asarray(values)
    check_type(path, field, array.dtype)
    single = array.dtype == np.float32 or (array.dtype.kind in "iu" and array.dtype.itemsize <= 2)
    return array.astype(np.float32 if single else float, copy=False)


def check_type(path: Path, field: str, dtype: np.dtype) -> None:
    """Raise InputError where values of a type are not real numbers."""
    if dtype.kind in "fiu":
        return
    if dtype.kind == "c":
        problem, remedy = "complex numbers", "A pressure against time is real; give its real values"
    elif dtype.names is not None:
        names = ", ".join(dtype.names)
        problem, remedy = f"a structure of {names}", f"Store {field} by itself, as plain numbers"
    else:
        problem, remedy = f"not all numbers (type {dtype})", "Export plain decimal numbers"
    raise InputError(path, field, problem, remedy)


def one_number(path: Path, field: str, value) -> float | None:
    """`value` as one float; None stays None. Raises InputError for text, none or several."""
    if value is None:
        return None
    if isinstance(value, (str, bytes)):
        raise InputError(path, field, f"{value!r} is text, not a number", "Store it as a number")
    array = numbers(path, field, value)
    if array.size != 1:
        problem = "empty" if not array.size else f"{array.size} values, one is needed"
        raise InputError(path, field, problem, "Store one number")
    return float(array.ravel()[0])


def missing_sensor(path: Path, name: str, present: Iterable) -> InputError:
    """The error for a file that lacks a sensor of the rig."""
    present = [str(other) for other in present]
    found = ", ".join(present) or "nothing"
    near = similar_name(name, present)
    hint = f"Did you mean {near}? Rename it to {name}" if near else "Add it to the file"
    if near and set(near) & set("[(/"):
        hint += " and give Pa"
    return InputError(
        path,
        name,
        f"no data for this sensor; the file has {found}",
        f"{hint}; or take the sensor out of `sensors`, or correct its name in rig.yaml",
    )


def similar_name(name: str, present: Iterable[str]) -> str | None:
    """The name among `present` that differs from `name` by case, spaces, a unit or a letter."""
    present = list(present)
    wanted = name.casefold()
    for other in present:
        plain = other.strip().casefold()
        rest = plain[len(wanted) : len(wanted) + 1]
        if plain.startswith(wanted) and not rest.isalnum() and other != name:
            return other
    return next(iter(difflib.get_close_matches(name, present, n=1, cutoff=0.7)), None)


def rows_of(path: Path, pressure: np.ndarray, sensors: list[str], names: list[str] | None):
    """The rows (S, N) of `pressure` for `sensors`: by name where the file names its rows."""
    if pressure.ndim != 2:
        raise InputError(
            path,
            "pressure",
            f"has {pressure.ndim} dimensions, shape {pressure.shape}",
            "Store it as (sensors, samples)",
        )
    if names is not None:
        if len(names) != len(pressure) or len(set(names)) < len(names):
            raise InputError(
                path,
                "sensors",
                f"names {', '.join(names)} for {len(pressure)} row(s) of pressure",
                "Give each row one name, in the order of the rows",
            )
        raise_any(missing_sensor(path, s, names) for s in sensors if s not in names)
        order = [names.index(sensor) for sensor in sensors]
        return pressure if order == list(range(len(pressure))) else pressure[order]
    if len(pressure) < len(sensors):
        present = f"{len(pressure)} row(s) of {pressure.shape[1]} samples"
        raise missing_sensor(path, sensors[len(pressure)], [present])
    if len(pressure) > len(sensors):
        turned = "; it looks transposed" if pressure.shape[1] == len(sensors) else ""
        raise InputError(
            path,
            "pressure",
            f"shape {pressure.shape}, but rig.yaml lists {len(sensors)} sensor(s){turned}",
            "Store it as (sensors, samples), one row a sensor of rig.yaml, in its order",
        )
    return pressure
