"""A user's Python file that defines one object: a fault, an effect."""

from __future__ import annotations

import importlib.util
from pathlib import Path

from rippletwin.errors import InputError


def read_object(path: str | Path, name: str, kind: type, option: str, known: str = ""):
    """The object `name` of the Python file, an instance of `kind`.

    option  of the command line that names the file, for messages
    known   what may be named instead of a file, for messages

    Raises InputError where there is no such file, where it fails, or where it defines no such
    object.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(
            path,
            option,
            f"neither a known {kind.__name__.lower()} nor a file" if known else "no such file",
            f"Give a Python file that defines {name}" + (f", or one of {known}" if known else ""),
        )
    spec = importlib.util.spec_from_file_location(f"{name.lower()}_of_{path.stem}", path)
    if spec is None:
        raise InputError(path, option, "no Python file", "Its name must end in .py")
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:  # a user's code may raise anything
        raise InputError(path, name, f"the file fails: {error!r}", "Correct it") from error
    found = getattr(module, name, None)
    if not isinstance(found, kind):
        raise InputError(
            path,
            name,
            f"missing, or no {kind.__name__}",
            f"Define {name} = {kind.__module__}.{kind.__name__}(...)",
        )
    return found
