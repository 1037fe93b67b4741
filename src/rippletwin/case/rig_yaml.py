"""rig.yaml: find it, read it and say everything that is wrong with it."""

from __future__ import annotations

from pathlib import Path

from rippletwin.case.plausibility import implausible_values
from rippletwin.case.schema_errors import schema_errors, shown
from rippletwin.case.sheet_checks import sheet_errors
from rippletwin.case.yaml_limits import read_yaml
from rippletwin.errors import InputError, raise_any


def find_sheet(case: str | Path) -> Path:
    """The path of a case's rig.yaml, given its folder or that file; raises InputError."""
    case = Path(case)
    try:
        path = case if case.name == "rig.yaml" and case.is_file() else case / "rig.yaml"
        if path.is_file():
            return path
        folder = case.is_dir()
    except (OSError, ValueError) as error:
        raise InputError(case, "case", f"cannot be opened ({error})", "Correct the path") from error
    if folder:
        problem, remedy = "not there", "A case is a folder that holds a rig.yaml"
    else:
        problem = "the case is a file" if case.exists() else "there is no such folder"
        remedy = "Give the folder that holds rig.yaml"
    raise InputError(path, "rig.yaml", problem, remedy)


def read_sheet(path: Path) -> dict:
    """The mapping in a rig.yaml; raises InputError for all that is wrong with the sheet itself.

    Whether the files exist that it names is another question (`sheet_checks.missing_files`).
    """
    sheet = parse_sheet(path)
    raise_any(find_sheet_faults(path, sheet))
    return sheet


def find_sheet_faults(path: Path, sheet: dict) -> list[InputError]:
    """Everything that is wrong with a sheet: against its schema, with itself, and with physics."""
    return [
        *schema_errors(path, sheet),
        *sheet_errors(path, sheet),
        *implausible_values(path, sheet),
    ]


def parse_sheet(path: Path) -> dict:
    """The mapping in a rig.yaml, whatever it holds; raises InputError where there is none."""
    sheet = read_yaml(path)
    if not isinstance(sheet, dict):
        raise InputError(
            path,
            "the whole file",
            f"holds {shown(sheet)}, not a mapping of keys to values",
            "Write fluid, line, load and recordings, each followed by a colon",
        )
    return sheet
