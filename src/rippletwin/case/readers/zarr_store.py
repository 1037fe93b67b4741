"""zarr: array `pressure`, in either orientation, Pa, with the attribute `sampling_rate_hz`.

The attribute may sit on the array, on its group or on the store. Optional: attribute `sensors`, the
channels' names; array `time_s` (samples,). rig.yaml may name others.
"""

from __future__ import annotations

from pathlib import Path

import zarr

from rippletwin.case.readers.arrays import ArrayFile, read_arrays
from rippletwin.case.readers.file_checks import refuse_damaged
from rippletwin.case.readers.layout import Layout
from rippletwin.case.readers.signals import Signals, check_type
from rippletwin.errors import InputError

COPY = "Copy what it leads to in its place"


def read(path: Path, layout: Layout) -> Signals:
    """Read a recording in a zarr store, a folder; raises InputError."""
    _refuse_links(path)
    with refuse_damaged(path, "or is no zarr store"):
        store = zarr.open_group(path, mode="r")
        members = store.members(max_depth=4)
        arrays = {name: item for name, item in members if isinstance(item, zarr.Array)}
        groups = {name: item for name, item in members if isinstance(item, zarr.Group)}

        def array(name: str) -> zarr.Array | None:
            item = arrays.get(name)
            if item is not None and not item.size:
                raise InputError(path, name, "empty", "Store numbers in it")
            if item is not None:
                check_type(path, name, item.dtype)
            return item

        def attribute(beside: str, name: str):
            group = groups.get(beside.rpartition("/")[0])
            holders = (arrays.get(beside), group, store)
            return next((h.attrs[name] for h in holders if h is not None and name in h.attrs), None)

        return read_arrays(ArrayFile(path, lambda: list(arrays), array, attribute), layout)


def _refuse_links(path: Path) -> None:
    """Raise InputError where a member of a store is a link, which may lead out of the case."""
    for member in path.rglob("*"):
        if member.is_symlink():
            name = member.relative_to(path).as_posix()
            raise InputError(path, name, "a link; those in a store are not followed", COPY)
