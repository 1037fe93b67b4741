"""Small tables of a case: flow ripples, impedances, spectra. Each is a CSV or bare columns."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from rippletwin.case.model import FlowRipple
from rippletwin.case.readers.file_checks import DOUBLE, check_readable, check_size
from rippletwin.case.readers.signals import similar_name
from rippletwin.case.readers.text_tables import fields, first_lines, is_numeric, separator_error
from rippletwin.errors import InputError, raise_any

LARGEST_PLAUSIBLE_FLOW = 1.0  # m3/s; a pump of 60,000 L/min
SMALLEST_RIPPLE = 1e-9  # of the largest flow; less is rounding
MAX_TABLE_GIB = 0.05


def read_table(path: Path, columns: list[str]) -> np.ndarray:
    """The named columns (len(columns), rows) of a text table, finite.

    A table without a header, of numbers only, is taken column by column; it may be separated by
    white space. Raises InputError where a column is absent or a number is not finite.
    """
    check_readable(path)
    check_size(path, "file", path.stat().st_size // DOUBLE, MAX_TABLE_GIB)
    lines = first_lines(path)
    bare = is_numeric(lines[0])
    named = set(fields(lines[0])) | set(lines[0].split())
    if not bare and not set(columns) <= named:
        raise_any(filter(None, [separator_error(path, lines, columns)]))
    try:
        table = pd.read_csv(
            path,
            sep="," if "," in lines[0] else r"\s+",
            header=None if bare else 0,
            skipinitialspace=True,
            encoding="utf-8-sig",
        )
    except (OSError, ValueError) as error:  # those of pandas are ValueErrors
        reason = str(error).removeprefix("Error tokenizing data. C error: ").strip()
        raise InputError(
            path, "file", f"cannot be read as a table ({reason})", f"Columns: {','.join(columns)}"
        ) from error
    if bare:
        if table.shape[1] < len(columns):
            raise InputError(
                path,
                columns[table.shape[1]],
                f"missing: the table has {table.shape[1]} columns",
                f"Columns, in this order: {','.join(columns)}",
            )
        table = table.iloc[:, : len(columns)].set_axis(columns, axis=1)
    table.columns = [str(column).strip() for column in table.columns]
    if table.empty:
        raise InputError(path, "file", "no rows", f"Columns: {','.join(columns)}")
    for column in columns:
        if column not in table:
            near = similar_name(column, table.columns)
            raise InputError(
                path,
                column,
                f"missing: the table has {', '.join(table.columns)}",
                f"{f'Did you mean {near}? ' if near else ''}Columns: {','.join(columns)}",
            )
        values = pd.to_numeric(table[column], errors="coerce").to_numpy(float)
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            raise InputError(
                path,
                column,
                f"{bad.size} value(s) are not finite numbers, the first in row {bad[0] + 1}",
                "Correct or remove these rows",
            )
        table[column] = values
    return table[columns].to_numpy(float).T


def read_flow_ripple(path: Path) -> FlowRipple:
    """Columns angle_deg, flow_m3_s over one revolution."""
    angle, flow = read_table(path, ["angle_deg", "flow_m3_s"])
    _ascending(path, "angle_deg", angle)
    step = np.max(np.diff(angle), initial=0.0)
    if (
        angle.size < 32
        or angle[-1] - angle[0] > 360 + 1e-6
        or angle[0] + 360 - angle[-1] > 3 * step
    ):
        raise InputError(
            path,
            "angle_deg",
            f"{angle.size} angles from {angle[0]:g} to {angle[-1]:g} are not one revolution",
            "Give at least 32 angles over one whole revolution, 0 to 360 degrees",
        )
    _check_flow(path, flow)
    if angle[-1] - angle[0] > 360 - 1e-6:  # the end repeats the beginning
        angle, flow = angle[:-1], flow[:-1]
    return FlowRipple(angle_deg=angle, flow=flow)


def _check_flow(path: Path, flow: np.ndarray) -> None:
    """Raise InputError where `flow` (M,), m3/s, cannot be a pump's flow into a line."""
    largest, mean = float(np.max(np.abs(flow))), float(np.mean(flow))
    if largest > LARGEST_PLAUSIBLE_FLOW:
        problem = f"up to {largest:g} m3/s is implausible"
        remedy = "Give m3/s: divide L/min by 60000"
    elif np.ptp(flow) <= SMALLEST_RIPPLE * largest:
        problem = f"the flow is {mean:g} m3/s throughout, without any ripple"
        remedy = "Give the flow against the shaft angle, or leave flow_ripple out"
    elif mean < -SMALLEST_RIPPLE * largest:
        problem = f"the mean flow is negative, {mean:g} m3/s"
        remedy = "Flow from the pump into the line is positive: change the sign"
    else:
        return
    raise InputError(path, "flow_m3_s", problem, remedy)


def read_impedance(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Columns frequency_hz, re, im -> frequency_hz (F,), impedance (F,) complex."""
    frequency, real, imaginary = read_table(path, ["frequency_hz", "re", "im"])
    _ascending(path, "frequency_hz", frequency)
    return frequency, real + 1j * imaginary


def read_repeats(files: list[Path], sensors: list[str] | None) -> tuple[np.ndarray, np.ndarray]:
    """Repeated spectra -> frequency_hz (F,), values (repeats, S, F) at the frequencies all share.

    `sensors` names the sensors of a multi-sensor spectrum (columns p1_re, p1_im, ...); None reads
    an input impedance (columns re, im; S = 1).
    """
    parts = ["re", "im"] if sensors is None else [f"{s}_{p}" for s in sensors for p in ("re", "im")]
    tables = [read_table(path, ["frequency_hz", *parts]) for path in files]
    for path, table in zip(files, tables):
        _ascending(path, "frequency_hz", table[0])
    shared = np.round(tables[0][0], 6)
    for path, table in zip(files[1:], tables[1:]):
        shared = np.intersect1d(shared, np.round(table[0], 6))
        if not shared.size:
            raise InputError(
                path,
                "frequency_hz",
                f"no frequency in common with {files[0].name}",
                "Measure repeats at the same frequencies",
            )
    values = []
    for table in tables:
        at_shared = table[1:, np.isin(np.round(table[0], 6), shared)]
        values.append(at_shared[0::2] + 1j * at_shared[1::2])
    return shared, np.array(values)


def _ascending(path: Path, column: str, values: np.ndarray) -> None:
    bad = np.flatnonzero(np.diff(values) <= 0)
    if bad.size or values[0] < 0:
        row = bad[0] + 2 if bad.size else 1
        raise InputError(
            path,
            column,
            f"{values[row - 1]:g} in row {row} is not larger than what comes before",
            "Sort the rows; each value once, none negative",
        )
