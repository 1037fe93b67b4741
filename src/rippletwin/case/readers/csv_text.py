"""CSV: columns `time_s,p1,p2,...`, one a sensor of the rig, Pa; further columns are ignored.

`time_s` may be absent where rig.yaml gives sampling_rate_hz for the recording.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from rippletwin.case.readers.file_checks import check_size
from rippletwin.case.readers.signals import Signals, missing_sensor
from rippletwin.case.readers.text_tables import (
    fields,
    first_lines,
    ragged_error,
    separator_error,
)
from rippletwin.errors import InputError, raise_any

ROWS_AT_ONCE = 200_000  # so that a wide or a wrong file does not fill the memory


def read(path: Path, sensors: list[str]) -> Signals:
    """Read a CSV recording; raises InputError."""
    wanted = _columns(path, sensors)
    parts: list[np.ndarray] = []
    rows = 0
    try:
        with pd.read_csv(
            path,
            skipinitialspace=True,
            encoding="utf-8-sig",
            chunksize=ROWS_AT_ONCE,
            low_memory=False,
        ) as chunks:
            for chunk in chunks:
                chunk.columns = [str(name).strip() for name in chunk.columns]
                parts.append(np.array([_floats(path, n, chunk[n], rows) for n in wanted]))
                rows += len(chunk)
                check_size(path, "file", rows * len(wanted))
    except InputError:
        raise
    except (OSError, ValueError) as error:  # those of pandas are ValueErrors
        reason = str(error).removeprefix("Error tokenizing data. C error: ").strip()
        raise InputError(
            path, "file", f"cannot be read as CSV ({reason})", "Columns: time_s,p1,p2,..."
        ) from error
    if not rows:
        raise InputError(path, "file", "a header and no rows", "Export the recording again")
    table = dict(zip(wanted, np.concatenate(parts, axis=1)))
    return Signals(
        pressure=np.array([table[sensor] for sensor in sensors]), time_s=table.get("time_s")
    )


def _columns(path: Path, sensors: list[str]) -> list[str]:
    """The columns to be read: `time_s` where there is one, and the sensors."""
    lines = first_lines(path)
    present = fields(lines[0])
    if not any(present):
        remedy = f"Begin with the columns' names: time_s,{','.join(sensors)}"
        raise InputError(path, "line 1", "empty", remedy)
    missing = [sensor for sensor in sensors if sensor not in present]
    if missing:
        error = separator_error(path, lines, sensors)
        raise_any([error] if error else [missing_sensor(path, s, present) for s in missing])
    wanted = [*(["time_s"] if "time_s" in present else []), *sensors]
    for name in wanted:
        if present.count(name) > 1:
            raise InputError(path, name, "two columns have this name", "Rename one of them")
    raise_any(filter(None, [ragged_error(path, lines, len(present))]))
    return wanted


def _floats(path: Path, name: str, column: pd.Series, before: int) -> np.ndarray:
    """A column as floats; `before` rows came earlier. Raises InputError at the first bad one."""
    values = pd.to_numeric(column, errors="coerce").to_numpy(float)
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        cell = column.iloc[bad[0]]
        row = before + int(bad[0]) + 1
        if pd.isna(cell):
            cut = ", the last one: it may be cut short" if _is_last(path, row) else ""
            problem = f"no number (empty or NaN) in data row {row}{cut}"
        else:
            shown = repr(cell) if isinstance(cell, str) else f"{cell:g}"
            problem = f"{shown} in data row {row} is not a finite number"
        raise InputError(
            path,
            name,
            problem,
            "Export plain decimal numbers with a decimal point, every row whole and without gaps",
        )
    return values


def _is_last(path: Path, row: int) -> bool:
    """Whether the data row `row` (from 1, under a header) is the last line of a file."""
    with open(path, "rb") as file:
        return sum(1 for _ in file) <= row + 1
