"""CSV and other text: one column a sensor, named as the sensor or as rig.yaml says, Pa.

Separator, decimal sign and lines above the header are found out (`text_tables`). A column `time_s`
may be absent where rig.yaml gives sampling_rate_hz for the recording.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from rippletwin.case.readers.file_checks import check_size
from rippletwin.case.readers.layout import Layout, choose, find_time, number_error
from rippletwin.case.readers.signals import Signals
from rippletwin.case.readers.text_tables import (
    TextFormat,
    find_format,
    open_rows,
    parse_floats,
    parse_reason,
)
from rippletwin.errors import InputError, raise_any

ROWS_AT_ONCE = 200_000  # so that a wide or a wrong file does not fill the memory


def read(path: Path, layout: Layout) -> Signals:
    """Read a recording in a text file; raises InputError."""
    form = find_format(path, layout.names)
    chosen, time = _columns(path, layout, form)
    wanted = dict(zip(chosen, layout.sensors)) | ({} if time is None else {time: layout.time_name})
    if form.rows_from is None:
        raise InputError(path, "file", "a header and no rows", "Export the recording again")
    parts: list[np.ndarray] = []
    rows = 0
    try:
        with (
            open_rows(path, form) as file,
            pd.read_csv(file, **form.options, chunksize=ROWS_AT_ONCE, low_memory=False) as chunks,
        ):
            for chunk in chunks:
                parts.append(
                    np.array(
                        [_floats(path, n, chunk.iloc[:, k], rows, form) for k, n in wanted.items()]
                    )
                )
                rows += len(chunk)
                check_size(path, "file", rows * len(wanted))
    except InputError:
        raise
    except UnicodeDecodeError as error:
        raise InputError(
            path,
            "file",
            f"the byte 0x{error.object[error.start]:02x} far down is not UTF-8",
            "Save it with encoding UTF-8",
        ) from error
    except (OSError, ValueError) as error:  # those of pandas are ValueErrors
        raise InputError(
            path,
            "file",
            f"cannot be read as CSV ({parse_reason(error, form)})",
            "Export every row with as many fields as the header",
        ) from error
    table = dict(zip(wanted, np.concatenate(parts, axis=1)))
    return Signals(
        pressure=np.array([table[k] for k in chosen]),
        time_s=None if time is None else table[time],
    )


def _columns(path: Path, layout: Layout, form: TextFormat) -> tuple[list[int], int | None]:
    """Positions of the sensors' columns, and of the times where there are any."""
    if form.names is not None:
        return choose(path, layout, form.names), find_time(path, layout, form.names)
    if layout.names:
        named = ",".join([layout.time_name, *layout.sensors])
        raise InputError(
            path,
            f"line {form.rows_from + 1}",
            "holds numbers; there is no header",
            f"Write the columns' names into the first line: {named}; or number the columns in "
            f"rig.yaml: channels: {{{layout.sensors[0]}: 2}}",
        )
    if layout.time is not None:
        raise InputError(
            path,
            "time",
            f"{layout.time}: the file has no header, so no column has a name",
            "Write the columns' names into the first line, or take time out and give "
            "sampling_rate_hz",
        )
    count = form.columns
    chosen = [int(layout.channels[sensor]) for sensor in layout.sensors]
    raise_any(
        number_error(path, s, count) for s, k in zip(layout.sensors, chosen) if not 1 <= k <= count
    )
    return [k - 1 for k in chosen], None


def _floats(path: Path, name: str, column: pd.Series, before: int, form: TextFormat) -> np.ndarray:
    """A column as floats; `before` rows came earlier. Raises InputError at the first bad one."""
    values = parse_floats(column, form)
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        cell = column.iloc[bad[0]]
        row = before + int(bad[0]) + 1
        if pd.isna(cell):
            cut = ", the last one: it may be cut short" if _is_last(path, form, row) else ""
            problem = f"no number (empty or NaN) in data row {row}{cut}"
        else:
            shown = repr(cell) if isinstance(cell, str) else f"{cell:g}"
            problem = f"{shown} in data row {row} is not a finite number"
        raise InputError(
            path,
            name,
            f"{problem} (line {form.line_of(row)})",
            "Export plain numbers, every row whole and without gaps",
        )
    return values


def _is_last(path: Path, form: TextFormat, row: int) -> bool:
    """Whether the data row `row` (from 1) is the last line of a file."""
    with open(path, "rb") as file:
        return sum(1 for _ in file) <= form.line_of(row)
