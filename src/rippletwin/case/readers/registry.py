"""Which reader reads a file: one reader a file format, chosen by the file's suffix."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

from rippletwin.case.readers.file_checks import check_readable
from rippletwin.case.readers.signals import Signals
from rippletwin.errors import InputError

MODULES = {".h5": "hdf5", ".hdf5": "hdf5", ".csv": "csv_text", ".mat": "matlab", ".tdms": "tdms"}


def read_signals(path: Path, sensors: list[str]) -> Signals:
    """Read a recording with the reader of its suffix, whose library is imported only now.

    Raises InputError where no reader knows the suffix, or the file cannot be read.
    """
    name = MODULES.get(path.suffix.lower())
    if name is None:
        raise InputError(
            path,
            "file",
            f"no reader for {path.suffix or 'a file without a suffix'}",
            f"Give one of {', '.join(MODULES)}",
        )
    check_readable(path)
    return import_module(f"rippletwin.case.readers.{name}").read(path, sensors)
