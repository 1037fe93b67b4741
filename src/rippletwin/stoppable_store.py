"""A zarr store in a folder that can be told to write no more."""

from __future__ import annotations

from threading import Lock
from typing import TYPE_CHECKING, Any

from zarr.storage import LocalStore

if TYPE_CHECKING:
    from zarr.core.buffer import Buffer


class StoppableStore(LocalStore):
    """`LocalStore` whose folder can be removed after `stop`.

    Where one chunk of an array fails, zarr raises the error and goes on with the others in threads
    of its own, which make the folder anew after it was removed. Here chunks are written one after
    another, and none after `stop`.
    """

    def __init__(self, *args: Any, **kwargs: Any):
        super().__init__(*args, **kwargs)
        self._writing, self._stopped = Lock(), False

    def stop(self) -> None:
        """Write no more: what zarr asks for from here on is left out. A write that has begun ends
        first."""
        with self._writing:
            self._stopped = True

    async def set(self, key: str, value: Buffer) -> None:
        """Write a value at a key, unless the store was stopped. Raises OSError."""
        with self._writing:
            if not self._stopped:
                self.set_sync(key, value)
