"""Options that several commands share. Each is checked before anything is read or fitted."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from pathlib import Path

import click

from rippletwin.errors import InputError

MAX_PROCESSES = 1024
EFFECTIVE = os.access in os.supports_effective_ids


class CheckedValue(click.ParamType):
    """A value that `read` makes of the text; it raises ValueError("problem. remedy")."""

    def __init__(self, name: str, read: Callable):
        self.name, self.read = name, read

    def convert(self, value, param, ctx):
        try:
            return self.read(value)
        except ValueError as error:
            problem, _, remedy = str(error).partition(". ")
            raise InputError("command line", param.opts[-1], problem, remedy) from None


def number(text: str, what: str, unit: str, floor: float | None = None) -> float:
    """A finite number that is positive or, where `floor` is given, not below it.

    Raises
    ------
    ValueError : says what it is not.
    """
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if math.isfinite(value) and (value > 0 if floor is None else value >= floor):
        return value
    which = "a positive number" if floor is None else f"a number from {floor:g} up"
    raise ValueError(f"{text} is no {what}. Give {which} of {unit}")


def whole_number(text: str, what: str, low: int, high: int) -> int:
    """A whole number from `low` to `high`; ValueError says what it is not."""
    try:
        value = int(text)
    except ValueError:
        value = low - 1
    if not low <= value <= high:
        raise ValueError(f"{text} is no {what}. Give a whole number from {low} to {high}")
    return value


def _processes(text: str) -> int:
    try:
        return whole_number(text, "number of processes", 1, MAX_PROCESSES)
    except ValueError as error:
        raise ValueError(f"{error}; as many as there are processors is best") from None


def _out_folder(text: str) -> str:
    """Raise ValueError where results could not be written to this folder.

    This is asked before anything is fitted, so that hours of fitting are not lost at the end.
    """
    problem = None if text.strip() else "no folder is named"
    try:
        place = Path(text).absolute()
        while problem is None and not place.exists():
            place = place.parent
        if problem is None and not place.is_dir():
            problem = f"{place} is a file, not a folder"
        elif problem is None and not os.access(place, os.W_OK | os.X_OK, effective_ids=EFFECTIVE):
            problem = f"you are not allowed to write to {place}"
    except (OSError, ValueError) as error:
        problem = f"cannot be opened ({getattr(error, 'strerror', None) or error})"
    if problem is not None:
        raise ValueError(f"{problem}. Name a folder that you may write to")
    return text


def _out_file(text: str) -> str:
    """Raise ValueError where a file of this name could not be written."""
    if Path(text).is_dir():
        raise ValueError(f"{text} is a folder, not a file. Name a file, such as report.html")
    _out_folder(str(Path(text).parent) if text.strip() else text)
    return text


FREQUENCY = CheckedValue("HZ", lambda text: number(text, "frequency", "Hz, or leave it out"))

case = click.argument("case", metavar="CASE", type=click.Path(path_type=Path))
json_output = click.option(
    "--json", "as_json", is_flag=True, help="Print the result as JSON and nothing else."
)
no_figures = click.option(
    "--no-figures", is_flag=True, help="Write no figures, and remove those of an earlier call."
)


def out(help: str):
    """--out DIR, required."""
    kind = CheckedValue("DIR", _out_folder)
    return click.option("--out", required=True, metavar="DIR", type=kind, help=help)


def out_file(help: str, required: bool = True):
    """--out FILE."""
    kind = CheckedValue("FILE", _out_file)
    return click.option("--out", required=required, metavar="FILE", type=kind, help=help)


def processes(purpose: str):
    """--processes N."""
    return click.option(
        "--processes",
        type=CheckedValue("N", _processes),
        metavar="N",
        default=2,
        show_default=True,
        help=f"Processes to {purpose} with.",
    )


def frequency(name: str, help: str):
    """An option in Hz."""
    return click.option(name, type=FREQUENCY, metavar="HZ", help=help)


def effects(help: str):
    """--effects FILE."""
    return click.option("--effects", "effects", multiple=True, metavar="FILE", help=help)


def fail_on(words: Sequence[str], help: str):
    """--fail-on WORD: end with exit code 3 where the command has found this."""
    return click.option(
        "--fail-on",
        type=click.Choice(list(words)),
        multiple=True,
        metavar="WORD",
        help=f"{help} End with exit code 3 then; again for more. One of: {', '.join(words)}.",
    )
