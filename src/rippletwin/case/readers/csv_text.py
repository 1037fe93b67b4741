"""CSV: columns `time_s,p1,p2,...`, one a sensor of the rig, Pa; further columns are ignored.

`time_s` may be absent where rig.yaml gives sampling_rate_hz for the recording.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from rippletwin.case.readers.signals import Signals, missing_sensor
from rippletwin.errors import InputError


def read(path: Path, sensors: list[str]) -> Signals:
    """Read a CSV recording; raises InputError."""
    try:
        present = list(pd.read_csv(path, nrows=0, skipinitialspace=True, encoding="utf-8-sig"))
        for sensor in sensors:
            if sensor not in present:
                raise missing_sensor(path, sensor, present)
        wanted = [*(["time_s"] if "time_s" in present else []), *sensors]
        # only the columns that are wanted, so that a wide file does not fill the memory
        table = pd.read_csv(path, usecols=wanted, skipinitialspace=True, encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError, pd.errors.ParserError, pd.errors.EmptyDataError) as error:
        raise InputError(
            path, "file", f"cannot be read as CSV ({error})", "Columns: time_s,p1,p2,..."
        ) from error
    columns = {name: _floats(path, name, table[name]) for name in wanted}
    return Signals(
        pressure=np.array([columns[sensor] for sensor in sensors]),
        time_s=columns.get("time_s"),
    )


def _floats(path: Path, name: str, column: pd.Series) -> np.ndarray:
    values = pd.to_numeric(column, errors="coerce")
    text = values.isna() & column.notna()
    if text.any():
        row = int(np.argmax(text.to_numpy()))
        raise InputError(
            path,
            name,
            f"{column.iloc[row]!r} in data row {row + 1} is not a number",
            "Export plain decimal numbers with a decimal point",
        )
    return values.to_numpy(float)
