"""Small tables of a case: flow ripples, impedances, spectra. Each is a CSV or bare columns."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rippletwin.case.model import FlowRipple
from rippletwin.case.readers.file_checks import DOUBLE, check_readable, check_size
from rippletwin.case.readers.layout import similar_name
from rippletwin.case.readers.text_tables import (
    TextFormat,
    find_format,
    open_rows,
    parse_floats,
    parse_reason,
)
from rippletwin.errors import InputError

LARGEST_PLAUSIBLE_FLOW = 1.0  # m3/s; a pump of 60,000 L/min
SMALLEST_RIPPLE = 1e-9  # of the largest flow; less is rounding
FEWEST_ANGLES = 32  # of a flow ripple
LARGEST_STEP = 3.0  # of the angles of a flow ripple; relative to the others
MOST_HOLES = 3  # that are told from the coarse steps of a table
MAX_TABLE_GIB = 0.05


def read_table(path: Path, columns: list[str]) -> np.ndarray:
    """The named columns (len(columns), rows) of a text table, finite.

    A table without a header, of numbers only, is taken column by column. Separator and decimal sign
    are found out. Raises InputError where a column is absent or a number is not finite.
    """
    import pandas as pd  # takes a third of a second, which a case without tables does not need

    check_readable(path)
    check_size(path, "file", path.stat().st_size // DOUBLE, MAX_TABLE_GIB)
    form = find_format(path, columns)
    if form.rows_from is None:
        raise InputError(path, "file", "no rows", f"Columns: {','.join(columns)}")
    places = _places(path, columns, form)
    try:
        with open_rows(path, form) as file:
            table = pd.read_csv(file, **form.options)
    except (OSError, ValueError) as error:  # those of pandas are ValueErrors
        reason = parse_reason(error, form)
        raise InputError(
            path, "file", f"cannot be read as a table ({reason})", f"Columns: {','.join(columns)}"
        ) from error
    values = np.array([parse_floats(table.iloc[:, place], form) for place in places])
    for column, row in zip(columns, values):
        bad = np.flatnonzero(~np.isfinite(row))
        if bad.size:
            raise InputError(
                path,
                column,
                f"{bad.size} value(s) are not finite numbers, the first in row {bad[0] + 1} (line "
                f"{form.line_of(int(bad[0]) + 1)})",
                "Correct or remove these rows",
            )
    return values


def _places(path: Path, columns: list[str], form: TextFormat) -> list[int]:
    """Where the named columns are; a table without a header has them in their order."""
    if form.names is None:
        if form.columns < len(columns):
            raise InputError(
                path,
                columns[form.columns],
                f"missing: the table has {form.columns} columns",
                f"Columns, in this order: {','.join(columns)}",
            )
        return list(range(len(columns)))
    for column in columns:
        if column not in form.names:
            near = similar_name(column, form.names)
            raise InputError(
                path,
                column,
                f"missing: the table has {', '.join(form.names)}",
                f"{f'Did you mean {near}? ' if near else ''}Columns: {','.join(columns)}",
            )
    return [form.names.index(column) for column in columns]


def read_flow_ripple(path: Path) -> FlowRipple:
    """Columns angle_deg, flow_m3_s over one revolution."""
    angle, flow = read_table(path, ["angle_deg", "flow_m3_s"])
    _ascending(path, "angle_deg", angle)
    _check_angles(path, angle)
    if angle[-1] - angle[0] > 360 - 1e-6:  # the end repeats the beginning
        angle, flow = angle[:-1], flow[:-1]
    ripple = FlowRipple(angle_deg=angle, flow=flow)
    _check_flow(path, ripple)
    return ripple


def _check_angles(path: Path, angle: np.ndarray) -> None:
    """Raise InputError where ascending angles (M,), degrees, are not one revolution without a hole.

    A hole is a step that few others come near. Steps of a table that is refined where ports open
    differ more, but its coarse steps are many.
    """
    steps = np.diff(angle, append=angle[0] + 360)
    last, hole = angle.size - 1, int(np.argmax(steps))
    coarse = float(np.sort(steps)[-1 - MOST_HOLES :][0])
    holed = steps[hole] > LARGEST_STEP * coarse
    if angle.size < FEWEST_ANGLES or steps[last] < -1e-6 or (holed and hole == last):
        problem = f"{angle.size} angles from {angle[0]:g} to {angle[last]:g} are not one revolution"
        remedy = f"Give at least {FEWEST_ANGLES} angles over one whole revolution, 0 to 360 degrees"
        raise InputError(path, "angle_deg", problem, remedy)
    if holed:
        raise InputError(
            path,
            "angle_deg",
            f"a step of {steps[hole]:.4g} degrees from {angle[hole]:g} to {angle[hole + 1]:g} (row "
            f"{hole + 2}) among steps of {coarse:.3g} degrees",
            "Give the flow between these angles too",
        )


def _check_flow(path: Path, ripple: FlowRipple) -> None:
    """Raise InputError where `ripple` cannot be a pump's flow into a line."""
    flow, mean = ripple.flow, ripple.mean
    largest = float(np.max(np.abs(flow)))
    if largest > LARGEST_PLAUSIBLE_FLOW:
        problem = f"up to {largest:g} m3/s is implausible"
        remedy = "Give m3/s: divide L/min by 60000"
    elif np.ptp(flow) <= SMALLEST_RIPPLE * largest:
        problem = f"the flow is {mean:g} m3/s throughout, without any ripple"
        remedy = "Give the flow against the shaft angle, or leave flow_ripple out"
    elif mean < 0.0 and ripple.stated_mean is not None:
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
    an input impedance (columns re, im; S = 1). Raises InputError where a spectrum is zero at all
    sensors, and where files share no frequency.
    """
    parts = ["re", "im"] if sensors is None else [f"{s}_{p}" for s in sensors for p in ("re", "im")]
    tables = [read_table(path, ["frequency_hz", *parts]) for path in files]
    for path, table in zip(files, tables):
        _ascending(path, "frequency_hz", table[0])
        if sensors is not None:
            _check_silence(path, parts, table)
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


def _check_silence(path: Path, parts: list[str], table: np.ndarray) -> None:
    """Raise InputError where a spectrum, rows `parts` of a table (1 + 2 S, F) after the frequency,
    has no power. Errors are relative to the power; a row at 0 Hz is not used."""
    silent = np.flatnonzero((np.sum(table[1:] ** 2, axis=0) == 0.0) & (table[0] > 0.0))
    if silent.size:
        raise InputError(
            path,
            ", ".join(parts),
            f"{silent.size} row(s) are zero at all sensors, the first is row {silent[0] + 1} at "
            f"{table[0, silent[0]]:g} Hz",
            "Remove these rows: nothing was measured there",
        )


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
