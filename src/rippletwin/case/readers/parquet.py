"""Parquet: one column a sensor, named as the sensor or as rig.yaml says, Pa; optional `time_s`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from rippletwin.case.readers.file_checks import check_size, refuse_damaged
from rippletwin.case.readers.layout import Layout, choose, find_time
from rippletwin.case.readers.signals import Signals, numbers
from rippletwin.errors import InputError


def read(path: Path, layout: Layout) -> Signals:
    """Read a Parquet recording; raises InputError."""
    with refuse_damaged(path, "is cut short or not Parquet"), pq.ParquetFile(path) as file:
        names = file.schema_arrow.names
        chosen, time = choose(path, layout, names), find_time(path, layout, names)
        check_size(path, "file", file.metadata.num_rows * len(chosen))
        if not file.metadata.num_rows:
            raise InputError(path, "file", "no rows", "Export the recording again")
        wanted = [names[k] for k in (*chosen, *([] if time is None else [time]))]
        for name in wanted:
            if names.count(name) > 1:
                raise InputError(path, name, "two columns have this name", "Rename one of them")
        table = file.read(columns=wanted)
        columns = [_column(path, name, table.column(name)) for name in wanted]
    return Signals(
        pressure=np.array(columns[: len(chosen)]),
        time_s=None if time is None else columns[-1],
    )


def _column(path: Path, name: str, column: pa.ChunkedArray) -> np.ndarray:
    """A column's numbers; what is missing is NaN, which is told as a gap."""
    return numbers(path, name, column.to_numpy())
