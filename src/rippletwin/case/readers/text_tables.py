"""How a text table is written: separator, decimal sign, where its header and its rows are.

Spreadsheets and recorders write commas, semicolons, tabs or spaces, decimal points or commas, and
lines of their own above the header. The way in which most of the first rows are whole rows of
numbers under the header is the one that was meant.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import numpy as np

from rippletwin.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

HEAD_BYTES = 65536
HEAD_LINES = 200  # lines in which the header and the first rows are looked for
ROWS_TRIED = 20
MOST_UNIT_ROWS = 2  # between header and numbers: units, channel numbers in words
NAMES = {",": "commas", ";": "semicolons", "\t": "tabs", "|": "vertical bars", " ": "spaces"}
WAYS = [(sep, decimal) for decimal in ".," for sep in NAMES if (sep, decimal) != (",", ",")]
"""Separators and decimal signs that are tried; the first of equal ones is taken."""
EXPORT = "Export with semicolons between columns, or with a decimal point in numbers"
_NOT_FINITE = {"", "nan", "inf", "-inf", "+inf"}
_NUMBER = {
    ".": re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?"),
    ",": re.compile(r"[-+]?(\d+|\d*,\d+)([eE][-+]?\d+)?"),
}
_NEW_LINE = re.compile(r"\r\n|\r|\n")


@dataclass(frozen=True)
class TextFormat:
    """How a table is written.

    names      fields of its header; None where there is none
    rows_from  number of lines before the first row of numbers; None where there are no rows
    columns    fields of a row
    width      the same with the empty field of a separator at the end of the line
    """

    separator: str
    decimal: str
    names: list[str] | None
    rows_from: int | None
    columns: int
    width: int

    @cached_property
    def options(self) -> dict:
        """How pandas reads the rows (`open_rows`)."""
        return {
            "sep": r"\s+" if self.separator == " " else self.separator,
            "decimal": self.decimal,
            "header": None,
            "names": range(self.width),
            "index_col": False,
            "skipinitialspace": True,
        }

    def line_of(self, row: int) -> int:
        """The line, from 1, of the data row `row`, from 1."""
        return (self.rows_from or 0) + row


def find_format(path: Path, wanted: Sequence[str]) -> TextFormat:
    """How a text file is written whose columns should be named `wanted`; raises InputError."""
    lines = first_lines(path)
    if not any(line.strip(" ,;\t|") for line in lines):
        remedy = f"Begin with the columns' names: {','.join(wanted)}" if wanted else "Export again"
        raise InputError(path, "line 1", "empty", remedy)
    rows = {sep: [split_fields(line, sep) for line in lines] for sep in {way[0] for way in WAYS}}
    form = max((_tried(rows[way[0]], *way, wanted) for way in WAYS), key=lambda tried: tried[0])[1]
    _check_rows(path, lines, form)
    return form


def _tried(
    rows: list[list[str]], separator: str, decimal: str, wanted: Sequence[str]
) -> tuple[tuple, TextFormat]:
    """Rows split at `separator`, read in one way, after how well they read: the wanted names are
    there, rows are whole, fields are many."""
    named = next((k for k, row in enumerate(rows) if wanted and set(wanted) <= set(row)), None)
    if named is not None:
        header, first = named, _after_units(rows, named + 1, decimal)
    else:
        first = next((k for k, row in enumerate(rows) if _is_numeric(row, decimal)), None)
        header = None if first is None else _header_before(rows, first)
    if first is None and header is None:  # no numbers: the line with most fields may be a header
        header = max(range(len(rows)), key=lambda k: len(rows[k]))
    names = None if header is None else rows[header]
    tried = [] if first is None else [row for row in rows[first:] if any(row)][:ROWS_TRIED]
    count = len(tried[0]) if names is None else len(names)
    good = sum(_is_numeric(_whole(row, count), decimal) and bool(tried) for row in tried)
    width = max([count, *(len(row) for row in tried if _whole(row, count))])
    form = TextFormat(separator, decimal, names, first, count, width)
    return (named is not None, good / max(len(tried), 1), count), form


def _after_units(rows: list[list[str]], start: int, decimal: str) -> int | None:
    """The first row from `start` on that is no row of units; None where there is none."""
    units = 0
    for k in range(start, len(rows)):
        if not any(rows[k]):
            continue
        if units == MOST_UNIT_ROWS or any(f and _is_number(f, decimal) for f in rows[k]):
            return k
        units += 1
    return None


def _header_before(rows: list[list[str]], first: int) -> int | None:
    """The nearest row above the numbers that has as many fields, of which one is no number."""
    count = len(rows[first])
    for k in range(first - 1, max(first - 2 - MOST_UNIT_ROWS, -1), -1):
        if len(_whole(rows[k], count)) == len(_whole(rows[first], count)) and any(rows[k]):
            return k
        if any(rows[k]):
            return None
    return None


def _whole(row: list[str], count: int) -> list[str]:
    """A row without the empty field that a separator at the end of the line makes; empty where it
    has another number of fields than `count`."""
    if len(row) == count + 1 and not row[-1]:
        return row[:-1]
    return row if len(row) == count else []


def _check_rows(path: Path, lines: list[str], form: TextFormat) -> None:
    """Raise InputError where one of the first rows has more fields than the header."""
    if form.names is None or form.rows_from is None:
        return
    for number, line in enumerate(lines[form.rows_from :], form.rows_from + 1):
        found = split_fields(line, form.separator)
        if len(found) <= form.columns or _whole(found, form.columns):
            continue
        halves = len(found) == 2 * form.columns  # every number was cut in two
        raise InputError(
            path,
            f"line {number}",
            f"{len(found)} fields under a header of {form.columns}"
            + ("; the numbers may have decimal commas" if halves else ""),
            EXPORT if halves else "Export every row with as many fields as the header",
        )


def parse_floats(column: pd.Series, form: TextFormat) -> np.ndarray:
    """A column of a table as floats; what is no number is NaN."""
    import pandas as pd

    if form.decimal != "." and not pd.api.types.is_numeric_dtype(column):
        text = column.astype(str)
        pointed = text.str.contains(".", regex=False)  # of thousands: no decimal sign here
        column = text.mask(pointed).str.replace(form.decimal, ".", regex=False)
    return pd.to_numeric(column, errors="coerce").to_numpy(float)


@contextmanager
def open_rows(path: Path, form: TextFormat) -> Iterator[TextIO]:
    """The file, opened at its first row of numbers."""
    with open(path, encoding="utf-8-sig") as file:
        for _ in range(form.rows_from or 0):
            file.readline()
        yield file


def parse_reason(error: Exception, form: TextFormat) -> str:
    """What pandas says of rows that it cannot read, with the line as the file counts it."""
    reason = str(error).removeprefix("Error tokenizing data. C error: ").strip()
    ragged = re.match(r"Expected (\d+) fields in line (\d+), saw (\d+)", reason)
    if ragged is None:
        return reason
    return f"line {form.line_of(int(ragged[2]))} has {ragged[3]} fields, not {ragged[1]}"


def first_lines(path: Path) -> list[str]:
    """The complete lines among the first HEAD_BYTES of a text file; raises InputError."""
    try:
        with open(path, "rb") as file:
            head = file.read(HEAD_BYTES + 1)
    except OSError as error:
        raise InputError(path, "file", f"cannot be read ({error})", "Copy it again") from error
    whole = len(head) <= HEAD_BYTES
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise InputError(path, "file", "looks like UTF-16", "Save it with encoding UTF-8")
    if b"\x00" in head:
        raise InputError(
            path, "file", "holds NUL bytes, so it is no text", "Export plain text, encoding UTF-8"
        )
    if not whole:  # the last line may end within a character
        head = head[: head.rfind(b"\n") + 1]
    try:
        text = head.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = head.count(b"\n", 0, error.start) + 1
        raise InputError(
            path,
            "file",
            f"the byte 0x{head[error.start]:02x} in line {line} is not UTF-8",
            "Save it with encoding UTF-8",
        ) from error
    if not text:
        problem = "no lines" if whole else f"the first line is longer than {HEAD_BYTES} bytes"
        raise InputError(path, "file", problem, "Give one row a line, under a line of names")
    return _NEW_LINE.split(text)[:HEAD_LINES]


def split_fields(line: str, separator: str) -> list[str]:
    """The fields of a line, quotes and spaces taken off."""
    if separator == " ":
        return line.split()
    if '"' not in line:
        return [field.strip() for field in line.split(separator)] if line else []
    row = next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
    return [field.strip() for field in row]


def _is_numeric(row: list[str], decimal: str) -> bool:
    """Whether a row has a number, and nothing but numbers and gaps."""
    return any(row) and all(_is_number(field, decimal) for field in row)


def _is_number(field: str, decimal: str) -> bool:
    return bool(_NUMBER[decimal].fullmatch(field)) or field.casefold() in _NOT_FINITE
