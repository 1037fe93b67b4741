"""Files that are either whole or not there: xarray datasets in zarr stores, and text."""

from __future__ import annotations

import os
import shutil
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import xarray as xr


def save(dataset: xr.Dataset, path: str | Path, compressed: bool = True) -> None:
    """Write `dataset` to the zarr store `path`, replacing what is there.

    It is written beside it under a temporary name and moved into place, so that a killed run leaves
    nothing half-written that looks whole. `compressed=False` makes random reads of large images
    several times faster.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    scratch = Path(tempfile.mkdtemp(prefix=f".{path.name}.", dir=path.parent))
    encoding = {} if compressed else {name: {"compressors": None} for name in dataset.variables}
    try:
        # a dataset read from another store remembers that store's encoding; format 3 of zarr has no
        # text arrays yet
        dataset.drop_encoding().to_zarr(
            scratch / "new", mode="w", encoding=encoding, zarr_format=2, consolidated=False
        )
        if path.exists():
            os.replace(path, scratch / "old")
        os.replace(scratch / "new", path)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def load(path: str | Path) -> xr.Dataset:
    """Open a zarr store; arrays are read when they are used. Raises FileNotFoundError."""
    path = Path(path)
    if not path.is_dir():
        raise FileNotFoundError(f"no store at {path}")
    import xarray as xr

    return xr.open_zarr(path, chunks=None, consolidated=False)


def write_text(path: str | Path, text: str) -> Path:
    """Write a text file (UTF-8), whole or not at all, replacing what is there; its folder is made
    where needed. Returns its path."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{os.getpid()}.new")
    try:
        temporary.write_text(text, encoding="utf-8")
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
    return path
