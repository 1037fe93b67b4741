"""What is asked of a file before it is read: it may be opened, and what it holds fits in memory."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rippletwin.errors import InputError

MAX_GIB = 1.0  # of one recording's numbers: 21 minutes of two sensors at 51.2 kHz
GIB = 2**30
DOUBLE = 8  # bytes


def check_readable(path: Path) -> bytes:
    """The first bytes of a file; raises InputError where it is empty or may not be read."""
    try:
        with open(path, "rb") as file:
            head = file.read(16)
    except PermissionError as error:
        raise InputError(
            path, "file", "you are not allowed to read it", "Correct the file's permissions"
        ) from error
    except (OSError, ValueError) as error:
        raise InputError(
            path, "file", f"cannot be opened ({error})", "Correct its name, or copy it again"
        ) from error
    if not head:
        raise InputError(
            path, "file", "empty: cut short to nothing", "Copy it again from where it was recorded"
        )
    return head


def check_size(path: Path, field: str, count: int, limit_gib: float = MAX_GIB) -> None:
    """Raise InputError where `count` numbers in double precision exceed `limit_gib`."""
    if count * DOUBLE > limit_gib * GIB:
        raise InputError(
            path,
            field,
            f"{count:.6g} values need {count * DOUBLE / GIB:.3g} GiB; the limit is "
            f"{limit_gib:.3g} GiB",
            "Cut the recording to a shorter stretch; a hundred revolutions and more are enough",
        )


class BoundedFile(io.BufferedReader):
    """A file of which no more is read at once than it has left: a library that believes a damaged
    header would have Python allocate what it asks for first."""

    def __init__(self, path: Path):
        super().__init__(io.FileIO(path))
        self._size = path.stat().st_size

    def read(self, size: int | None = -1, /) -> bytes:
        left = max(self._size - self.tell(), 0)
        return super().read(left if size is None or size < 0 else min(size, left))

    def fileno(self) -> int:
        """None: with a number of the operating system, numpy would read past `read`."""
        raise io.UnsupportedOperation("fileno")


@contextmanager
def refuse_damaged(
    path: Path,
    guess: str,
    remedy: str = "Copy it again from where it was recorded",
) -> Iterator[None]:
    """Turn every error of the library that reads a file into an InputError: libraries raise a dozen
    kinds for a damaged file. `guess` is what the file may be instead, as "or is no zarr store".
    """
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        raise InputError(path, "file", f"cannot be read, {guess} ({error})", remedy) from error
