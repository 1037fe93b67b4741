"""Datasets and attributes of an HDF5 file, checked before anything of them is read.

A file may claim any shape, hold a group or a link in a dataset's place, or let its data lie in
another file. The shape, the type and the place of the data are therefore asked first.
"""

from __future__ import annotations

from pathlib import Path

import h5py

from rippletwin.case.readers.signals import check_type
from rippletwin.errors import InputError

MAX_ATTRIBUTE_BYTES = 100_000
MAX_NAMES = 50
HERE = "Store the numbers themselves in this file, as a dataset"


def names_in(file: h5py.Group) -> list[str]:
    """Names of what lies at the top of a file or group, without MATLAB's own."""
    return [name for name, _ in zip(file, range(MAX_NAMES)) if not name.startswith("#")]


def datasets_in(file: h5py.File) -> list[str]:
    """Names of the first datasets of a file, those in groups with their path; links are left."""
    found: list[str] = []

    def visit(name: str, item: object) -> bool | None:
        if isinstance(item, h5py.Dataset) and not name.startswith("#"):
            found.append(name)
        return True if len(found) >= MAX_NAMES else None

    file.visititems(visit)
    return found


def find_dataset(path: Path, file: h5py.File, name: str) -> h5py.Dataset | None:
    """A dataset of real numbers, unread; None where there is none of that name.

    Raises InputError where something else has the name, where the data lie in another file, or
    where they are no real numbers.
    """
    item = _item(path, file, name)
    if item is None:
        return None
    if isinstance(item, h5py.Group):
        inside = names_in(item)
        example = f"{name.strip('/')}/{inside[0]}" if inside else "GROUP/DATASET"
        raise InputError(
            path,
            name,
            f"a group that holds {', '.join(inside) or 'nothing'}, not a dataset",
            f"Name a dataset in it: dataset: {example}, or channels: {{SENSOR: {example}}}",
        )
    if not isinstance(item, h5py.Dataset):
        raise InputError(path, name, "a data type, not a dataset", HERE)
    if item.file.filename != file.filename or item.is_virtual or item.external:
        raise InputError(path, name, "its data lie in another file", HERE)
    if item.shape is None or not item.size:
        raise InputError(path, name, "empty", "Store numbers in it")
    check_type(path, name, item.dtype)
    return item


def _item(path: Path, file: h5py.File, name: str):
    """What stands under a name, that may have groups before it; None where nothing does."""
    item: h5py.Group = file
    for part in name.strip("/").split("/"):
        if not isinstance(item, h5py.Group) or not item.id.links.exists(part.encode()):
            return None
        kind = item.id.links.get_info(part.encode()).type
        if kind == h5py.h5l.TYPE_EXTERNAL:
            problem = "a link to another file; such links are not followed"
            raise InputError(path, name, problem, HERE)
        try:
            item = item[part]
        except (KeyError, RuntimeError, OSError) as error:
            if kind == h5py.h5l.TYPE_HARD:
                raise OSError(str(error)) from error
            problem = "a link that leads nowhere, to itself or to another file"
            raise InputError(path, name, problem, HERE) from error
    return item


def read_attribute(path: Path, file: h5py.File, beside: str, name: str):
    """An attribute of the dataset `beside`, of its group or of the file; None where none has it."""
    for holder in _holders(path, file, beside):
        if name not in holder.attrs:
            continue
        try:
            if holder.attrs.get_id(name).get_storage_size() > MAX_ATTRIBUTE_BYTES:
                raise InputError(path, name, "the attribute is too long", "Store a short value")
            return holder.attrs[name]
        except (OSError, TypeError, KeyError, RuntimeError) as error:
            problem = f"the attribute cannot be read ({error})"
            raise InputError(path, name, problem, "Store a number or text") from error
    return None


def _holders(path: Path, file: h5py.File, name: str) -> list:
    dataset = _item(path, file, name) if name else None
    return [file] if dataset is None else [dataset, dataset.parent, file]
