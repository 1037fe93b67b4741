"""Which reader reads a file: one reader a file format, chosen by the file's suffix."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from rippletwin.case.readers.signals import Signals
from rippletwin.errors import InputError

MODULES = {".h5": "hdf5", ".hdf5": "hdf5", ".csv": "csv_text", ".mat": "matlab", ".tdms": "tdms"}


def reader_of(path: Path) -> Callable[[Path, list[str]], Signals]:
    """The reader for a file's suffix; its library is imported only now."""
    name = MODULES.get(path.suffix.lower())
    if name is None:
        raise InputError(
            path,
            "file",
            f"no reader for {path.suffix or 'a file without a suffix'}",
            f"Give one of {', '.join(MODULES)}",
        )
    return import_module(f"rippletwin.case.readers.{name}").read
