"""What every reader returns, and the questions of type that readers share."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rippletwin.errors import InputError


@dataclass(frozen=True)
class Signals:
    """Pressure (S, N) in the rig's sensor order, with whatever the file says of its time axis.

    `counts` where the file's format holds a recorder's raw counts, which need a scale.
    """

    pressure: np.ndarray
    sampling_rate_hz: float | None = None
    time_s: np.ndarray | None = None
    counts: bool = False


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
