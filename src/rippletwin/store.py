"""Files that are either whole or not there: xarray datasets in zarr stores, and text."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd
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
    new = _open_stoppable(scratch / "new")
    encoding = {} if compressed else {name: {"compressors": None} for name in dataset.variables}
    try:
        # a dataset read from another store remembers that store's encoding; format 3 of zarr has no
        # text arrays yet
        dataset.drop_encoding().to_zarr(
            new, mode="w", encoding=encoding, zarr_format=2, consolidated=False
        )
        if path.exists():
            os.replace(path, scratch / "old")
        os.replace(scratch / "new", path)
    except OSError as error:
        _name(error, path, scratch)
        raise
    finally:
        new.stop()
        if (scratch / "old").exists() and not path.exists():
            os.replace(scratch / "old", path)
        shutil.rmtree(scratch, ignore_errors=True)


def _open_stoppable(folder: Path):
    """A zarr store in `folder` with a method `stop`, after which nothing is written.

    Where one chunk of an array fails, zarr raises the error and goes on with the others in threads
    of its own, which make the folder anew after it was removed. Here chunks are written one after
    another; a write that has begun ends before `stop` does, and later ones are left out.
    """
    from zarr.storage import LocalStore

    class StoppableStore(LocalStore):
        writing, stopped = Lock(), False

        def stop(self) -> None:
            with self.writing:
                self.stopped = True

        async def set(self, key, value) -> None:
            with self.writing:
                if not self.stopped:
                    self.set_sync(key, value)

    return StoppableStore(folder)


def load(path: str | Path) -> xr.Dataset:
    """Open a zarr store; arrays are read when they are used. Raises FileNotFoundError."""
    path = Path(path)
    if not path.is_dir():
        raise FileNotFoundError(f"no store at {path}")
    import xarray as xr

    return xr.open_zarr(path, chunks=None, consolidated=False)


@contextmanager
def whole(path: str | Path) -> Iterator[Path]:
    """The name under which to write a file that is then moved to `path`, whole or not at all.

    It is beside `path`, with its suffix. Where the writing fails, what was at `path` is still
    there, and nothing else. The folder is made where needed.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    scratch = path.with_name(f".{os.getpid()}.{path.name}")
    try:
        yield scratch
        os.replace(scratch, path)
    except OSError as error:
        _name(error, path, scratch)
        raise
    finally:
        scratch.unlink(missing_ok=True)


def _name(error: OSError, path: Path, scratch: Path) -> None:
    """Have the error name `path`, if it names no file or one of the temporary ones: a write without
    room names none."""
    if error.filename is None or str(error.filename).startswith(str(scratch)):
        error.filename = str(path)


def write_text(path: str | Path, text: str) -> Path:
    """Write a text file (UTF-8), whole or not at all; returns its path."""
    with whole(path) as scratch:
        scratch.write_text(text, encoding="utf-8")
    return Path(path)


def write_texts(folder: str | Path, texts: dict[str, str]) -> None:
    """Write text files (UTF-8) that belong together into `folder`, by name: all or, where one does
    not fit on the disk, none. They are put in place in the order given, once all are written."""
    with ExitStack() as written:
        # the last that is entered is the first that is put in place
        for name, text in reversed(texts.items()):
            scratch = written.enter_context(whole(Path(folder) / name))
            scratch.write_text(text, encoding="utf-8")


def write_table(path: str | Path, table: pd.DataFrame) -> None:
    """Write a table as CSV without its index, whole or not at all."""
    with whole(path) as scratch:
        table.to_csv(scratch, index=False)
