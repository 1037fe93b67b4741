"""The beginning of a text table: its encoding, its separator, its header, and what is wrong there.

Spreadsheets and recorders write semicolons, decimal commas and lines of preamble; read as comma
separated values such a table loses columns without a word.
"""

from __future__ import annotations

import csv
import re
from pathlib import Path

from rippletwin.errors import InputError

HEAD_BYTES = 65536
HEAD_LINES = 60  # lines in which a header is looked for behind a preamble
SEPARATORS = {";": "semicolons", "\t": "tabs", "|": "vertical bars", " ": "spaces"}
EXPORT = "Export with commas between columns and a decimal point in numbers"
_DECIMAL_COMMA = re.compile(r"(^|[;\t| ])\s*[-+]?\d+,\d+")


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
    lines = text.splitlines()
    if not lines:
        problem = "no lines" if whole else f"the first line is longer than {HEAD_BYTES} bytes"
        raise InputError(path, "file", problem, "Give one row a line, under a line of names")
    return lines[:HEAD_LINES]


def fields(line: str, separator: str = ",") -> list[str]:
    """The fields of a line, quotes and spaces taken off."""
    row = next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
    return [field.strip() for field in row]


def is_numeric(line: str) -> bool:
    """Whether a line holds numbers only, separated by commas or white space."""
    try:
        return bool([float(word) for word in line.replace(",", " ").split()])
    except ValueError:
        return False


def separator_error(path: Path, lines: list[str], names: list[str]) -> InputError | None:
    """What is wrong with a table whose first line lacks some of `names`, where it is the
    separator, the decimal sign, a preamble or a missing header; None where it is none of these."""
    wanted = {name.casefold() for name in names}
    comma = any(_DECIMAL_COMMA.search(line) for line in lines[:5])
    sign = "; numbers have decimal commas" if comma else ""
    for number, line in enumerate(lines, 1):
        for separator in (",", *SEPARATORS):
            if not wanted <= {name.casefold() for name in fields(line, separator)}:
                continue
            if number > 1:
                return InputError(
                    path,
                    f"line {number}",
                    f"the header stands here, behind {number - 1} line(s) of preamble",
                    "Remove the lines above the header; separate columns by commas",
                )
            if separator != ",":
                return InputError(
                    path,
                    "line 1",
                    f"columns are separated by {SEPARATORS[separator]}, not commas{sign}",
                    EXPORT,
                )
    if ";" in lines[0] and is_numeric(lines[0].replace(";", " ")):
        problem = f"columns are separated by semicolons, not commas{sign}"
        return InputError(path, "line 1", problem, EXPORT)
    if is_numeric(lines[0]):
        return InputError(
            path,
            "line 1",
            "holds numbers; there is no header",
            f"Write the columns' names into the first line: {','.join(names)}",
        )
    return None


def ragged_error(path: Path, lines: list[str], columns: int) -> InputError | None:
    """What is wrong where one of the first lines has more fields than the header."""
    for number, line in enumerate(lines[1:], 2):
        found = len(fields(line))
        if found > columns:
            halves = found == 2 * columns  # every number was cut in two
            return InputError(
                path,
                f"line {number}",
                f"{found} fields under a header of {columns}"
                + ("; the numbers may have decimal commas" if halves else ""),
                EXPORT,
            )
    return None
