"""What every reader returns, and the shape questions readers share."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rippletwin.errors import InputError


@dataclass(frozen=True)
class Signals:
    """Pressure (S, N) in the rig's sensor order, with whatever the file says of its time axis."""

    pressure: np.ndarray
    sampling_rate_hz: float | None = None
    time_s: np.ndarray | None = None


def numbers(path: Path, field: str, values) -> np.ndarray:
    """`values` as floats: single precision stays single, everything else becomes double."""
    array = np.asarray(values)
    if array.dtype == np.float32:
        return array
    try:
        return array.astype(float)
    except (TypeError, ValueError) as error:
        raise InputError(
            path, field, f"not all numbers ({error})", "Export plain decimal numbers"
        ) from error


def missing_sensor(path: Path, name: str, present) -> InputError:
    """The error for a file that lacks a sensor of the rig."""
    found = ", ".join(map(str, present)) or "nothing"
    return InputError(
        path,
        name,
        f"no data for this sensor; the file has {found}",
        "Add it to the file, or take it out of `sensors` or correct its name in rig.yaml",
    )


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
        for sensor in sensors:
            if sensor not in names:
                raise missing_sensor(path, sensor, names)
        order = [names.index(sensor) for sensor in sensors]
        return pressure if order == list(range(len(pressure))) else pressure[order]
    if len(pressure) < len(sensors):
        present = f"{len(pressure)} row(s) of {pressure.shape[1]} samples"
        raise missing_sensor(path, sensors[len(pressure)], [present])
    if len(pressure) > len(sensors):
        raise InputError(
            path,
            "pressure",
            f"shape {pressure.shape}, but rig.yaml lists {len(sensors)} sensor(s)",
            "Store it as (sensors, samples), one row a sensor of rig.yaml, in its order",
        )
    return pressure
