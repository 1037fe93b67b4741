"""Datasets and attributes of an HDF5 file, checked before anything of them is read.

A file may claim any shape, hold a group or a link in a dataset's place, or let its data lie in
another file. The shape, the type and the place of the data are therefore asked first.
"""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np

from rippletwin.case.readers.file_checks import check_size
from rippletwin.case.readers.signals import check_type, numbers
from rippletwin.errors import InputError

MAX_ATTRIBUTE_BYTES = 100_000
HERE = "Store the numbers themselves in this file, as a dataset"


def names_in(file: h5py.File, most: int = 50) -> list[str]:
    """Names of what lies at the top of a file, without MATLAB's own."""
    return [name for name, _ in zip(file, range(most)) if not name.startswith("#")]


def read_dataset(path: Path, file: h5py.File, name: str) -> tuple[np.ndarray, h5py.Dataset] | None:
    """A dataset's numbers and the dataset; None where there is none of that name.

    Raises InputError where something else has the name, where the data lie in another file, or
    where they are no real numbers or too many.
    """
    if not file.id.links.exists(name.encode()):
        return None
    kind = file.id.links.get_info(name.encode()).type
    if kind == h5py.h5l.TYPE_EXTERNAL:
        raise InputError(path, name, "a link to another file; such links are not followed", HERE)
    try:
        item = file[name]
    except (KeyError, RuntimeError, OSError) as error:
        if kind == h5py.h5l.TYPE_HARD:
            raise OSError(str(error)) from error
        problem = "a link that leads nowhere, to itself or to another file"
        raise InputError(path, name, problem, HERE) from error
    if not isinstance(item, h5py.Dataset):
        what = f"a group that holds {', '.join(names_in(item)) or 'nothing'}"
        problem = what if isinstance(item, h5py.Group) else "a data type"
        raise InputError(path, name, f"{problem}, not a dataset", HERE)
    if item.file.filename != file.filename or item.is_virtual or item.external:
        raise InputError(path, name, "its data lie in another file", HERE)
    if item.shape is None or not item.size:
        raise InputError(path, name, "empty", "Store numbers in it")
    check_type(path, name, item.dtype)
    check_size(path, name, item.size)
    return numbers(path, name, item[()]), item


def read_attribute(path: Path, holders: tuple, name: str):
    """An attribute's value, from the first of `holders` that has it; None where none does."""
    for holder in holders:
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
