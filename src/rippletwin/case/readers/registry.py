"""Which reader reads a file: one reader a file format, chosen by the file's suffix."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

from rippletwin.case.readers.file_checks import check_readable
from rippletwin.case.readers.layout import KEYS, Layout
from rippletwin.case.readers.signals import Signals
from rippletwin.errors import InputError

MODULES = {
    ".h5": "hdf5",
    ".hdf5": "hdf5",
    ".csv": "csv_text",
    ".txt": "csv_text",
    ".mat": "matlab",
    ".tdms": "tdms",
    ".wav": "wav",
    ".parquet": "parquet",
    ".uff": "uff58",
    ".unv": "uff58",
    ".zarr": "zarr_store",
}
FOLDERS = (".zarr",)
"""Suffixes of recordings that are folders."""
UNUSED = {
    "csv_text": ("dataset", "orientation", "rate"),
    "parquet": ("dataset", "orientation", "rate"),
    "uff58": ("dataset", "orientation", "rate", "time"),
    "wav": ("dataset", "orientation", "rate", "time"),
    "tdms": ("orientation",),
}
"""What of a layout means nothing in a format."""
EXTRAS = {"parquet": "pyarrow", "uff58": "pyuff"}
"""Readers whose library only the extra `readers` installs."""


def read_signals(path: Path, layout: Layout) -> Signals:
    """Read a recording with the reader of its suffix, whose library is imported only now.

    Raises InputError where no reader knows the suffix, or the file cannot be read.
    """
    suffix = path.suffix.lower()
    name = MODULES.get(suffix)
    if name is None:
        raise InputError(
            path,
            "file",
            f"no reader for {path.suffix or 'a file without a suffix'}",
            f"Give one of {', '.join(MODULES)}",
        )
    for key in UNUSED.get(name, ()):
        if getattr(layout, key) is not None:
            problem = f"means nothing for a {suffix} file"
            raise InputError(path, KEYS.get(key, key), problem, "Take it out of rig.yaml")
    if suffix not in FOLDERS:
        check_readable(path)
    try:
        reader = import_module(f"rippletwin.case.readers.{name}")
    except ModuleNotFoundError as error:
        if name not in EXTRAS:
            raise
        raise InputError(
            path,
            "file",
            f"{suffix} needs the package {EXTRAS[name]}, which is not installed",
            "pip install 'rippletwin[readers]', or export the recording as HDF5 or CSV",
        ) from error
    return reader.read(path, layout)
