"""What is wrong with a configuration or with the case that it names, one short line an error.

snakemake.utils.validate prints the whole schema and the whole configuration with the first error;
a person needs the key, and what it should be.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path

import jsonschema
import pandas as pd
import yaml
from snakemake.exceptions import WorkflowError

from rippletwin.case.load import load_case
from rippletwin.case.rig_yaml import find_sheet, read_sheet
from rippletwin.errors import InputError

MAX_VALUE_CHARACTERS = 60  # of a wrong value that a message shows


def check_config(config: dict, schema: Path) -> None:
    """Raise WorkflowError with a line for each key that violates the schema, a YAML file."""
    errors = sorted(
        _validator(schema).iter_errors(config), key=lambda error: list(map(str, error.path))
    )
    lines = [line for error in errors for line in _lines(error)]
    if lines:
        raise WorkflowError("\n".join([*lines, "config/README.md explains every key."]))


@cache
def _validator(schema: Path) -> jsonschema.Draft202012Validator:
    """What checks a configuration, made once from a YAML file."""
    return jsonschema.Draft202012Validator(yaml.safe_load(schema.read_text("utf-8")))


def check_names(key: str, names: Sequence[str], known: Sequence[str]) -> None:
    """Raise WorkflowError that names each value of a config key, `names`, that is not known."""
    lines = [
        f"config: {key}: {name!r} is not known. {_near(name, known)}"
        for name in names
        if name not in known
    ]
    if lines:
        raise WorkflowError("\n".join(lines))


def check_datasets(table: pd.DataFrame) -> None:
    """Raise WorkflowError where two rows of config/datasets.tsv have one name or are the same."""
    for columns in (["name"], ["signal", "line", "twin", "randomised", "anchored"]):
        twice = table[table.duplicated(columns, keep=False)]
        if len(twice):
            names = ", ".join(twice["name"])
            raise WorkflowError(f"config/datasets.tsv: {names}: the same {', '.join(columns)}")
    compared = [name for name in table["uncorrected"] if name != "none"]
    check_names("datasets.tsv: uncorrected", compared, list(table["name"]))


def check_severity(faults: dict) -> None:
    """Raise WorkflowError where a range of leak areas does not ascend, or the limit is outside."""
    for key, (low, high) in faults["severity"].items():
        if low >= high:
            raise WorkflowError(f"config: faults.severity.{key}: {low} to {high} must ascend")
    (low, high), limit = faults["severity"]["C"], faults["severity_limit"]
    if not low < limit < high:
        raise WorkflowError(
            f"config: faults.severity_limit: {limit} must be between {low} and {high}, "
            "the ends of faults.severity.C"
        )


def check_load_pressures(entries: Sequence[dict]) -> None:
    """Raise WorkflowError with a line for each recording, an entry of rig.yaml, without a load
    pressure: faults are simulated against it."""
    lines = [
        f"config: case: rig.yaml: {entry['file']}: load_pressure: missing. Faults are simulated "
        "against the mean load pressure; give it"
        for entry in entries
        if "load_pressure" not in entry
    ]
    if lines:
        raise WorkflowError("\n".join(lines))


def read_rig(case: str) -> tuple[str, dict]:
    """Path and content of the rig.yaml of the configured case, a folder or that file.

    The sheet is checked as a job would check it, without the recordings. Raises WorkflowError with
    a line for each thing that is wrong.
    """
    try:
        load_case(case, states=())
        path = find_sheet(case)
        return str(path), read_sheet(path)
    except InputError as error:
        lines = [f"config: case: {one}" for one in error.errors]
        raise WorkflowError("\n".join(lines)) from None


def _lines(error: jsonschema.ValidationError) -> Iterator[str]:
    path = list(error.absolute_path)
    if error.validator == "additionalProperties":
        known = list(error.schema["properties"])
        for key in error.instance:
            if key not in known:
                yield f"config: unknown key {_dotted([*path, key])}. {_near(str(key), known)}"
    elif error.validator == "required":
        missing = [key for key in error.validator_value if key not in error.instance]
        # jsonschema reports each missing key on its own; the first of them stands for all
        if error.message.startswith(repr(missing[0])):
            yield f"config: missing {', '.join(_dotted([*path, key]) for key in missing)}"
    else:
        value = str(error.instance)
        if len(value) > MAX_VALUE_CHARACTERS:
            value = value[:MAX_VALUE_CHARACTERS] + "..."
        wanted = error.schema.get("description", "")
        yield f"config: {_dotted(path)}: {value}: {_rule(error)}. {wanted}".rstrip()


def _rule(error: jsonschema.ValidationError) -> str:
    """What the violated keyword of the schema asks for."""
    asked = error.validator_value
    words = {
        "type": f"not of type {asked}",
        "enum": f"not one of {', '.join(map(str, asked))}" if error.validator == "enum" else "",
        "minimum": f"below {asked}",
        "maximum": f"above {asked}",
        "exclusiveMinimum": f"not above {asked}",
        "exclusiveMaximum": f"not below {asked}",
        "minItems": f"fewer than {asked} entries",
        "uniqueItems": "an entry is given twice",
    }
    return words.get(error.validator, f"{error.validator} {asked}")


def _near(name: str, known: Sequence[str]) -> str:
    near = difflib.get_close_matches(name, known, n=3)
    if near:
        return f"Did you mean {' or '.join(near)}? "
    return f"Known here: {', '.join(known)}. "


def _dotted(path: Sequence) -> str:
    """sst.size from ["sst", "size"]; the whole configuration where the path is empty."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path)
    return text.lstrip(".") or "the whole configuration"
