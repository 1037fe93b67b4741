"""Cases of measured lines: a data sheet of resources/, and the recorder's own files beside it."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path

from rippletwin.case.load import load_case
from rippletwin.case.model import Case

RESOURCES = Path(__file__).resolve().parent.parent / "resources"


def copy_case(line: str, files: Mapping[str, Path], folder: Path) -> Case:
    """The case of resources/`line` in `folder`, with measured files under these names.

    Ends the program with a message where one of the files is missing.
    """
    missing = [str(path) for path in files.values() if not path.is_file()]
    if missing:
        raise SystemExit(
            f"{missing[0]}: no such file. docs/explanation/validation.md says where to get the data"
        )
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(RESOURCES / line / "rig.yaml", folder)
    for name, path in files.items():
        shutil.copy(path, folder / name)
    return load_case(folder)
