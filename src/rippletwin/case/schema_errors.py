"""The schema of rig.yaml, and what its violations mean in plain words."""

from __future__ import annotations

import difflib
import math
import re
from functools import cache
from importlib import resources
from pathlib import Path

import jsonschema
import yaml

from rippletwin.case.sheet_values import leaves
from rippletwin.errors import InputError

TYPES = {
    "number": "a number",
    "integer": "a whole number",
    "string": "text",
    "boolean": "true or false",
    "array": "a list",
    "object": "a mapping of keys to values",
}
"""What the schema's types are called in messages."""

NOT_FINITE = {".nan", ".inf", "-.inf", "+.inf", "nan", "inf", "-inf"}
_DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d+([eE][-+]?\d+)?")
_BASE_60 = re.compile(r"[-+]?\d+(:\d+)+(\.\d+)?")
_WITH_UNIT = re.compile(r"([-+]?[\d.]+([eE][-+]?\d+)?)\s*[^\d\s].*")


@cache
def schema() -> dict:
    """The JSON schema of rig.yaml."""
    text = resources.files("rippletwin.case").joinpath("rig.schema.yaml").read_text("utf-8")
    return yaml.safe_load(text)


def schema_errors(path: Path, sheet: dict) -> list[InputError]:
    """Where a sheet violates its schema, one error a field, in the order of the fields."""
    errors = list(jsonschema.Draft202012Validator(schema()).iter_errors(sheet))
    errors.sort(key=lambda error: [str(part) for part in error.absolute_path])
    found = [one for error in errors for one in _explained(path, error)]
    reported = {error.field for error in found}
    for field, value in leaves(sheet):
        if isinstance(value, float) and not math.isfinite(value) and field not in reported:
            problem = "the number is not finite: beyond 1.8e308"
            found.append(InputError(path, field, problem, "Correct it"))
    return list({error.field: error for error in reversed(found)}.values())[::-1]


def _explained(path: Path, error: jsonschema.ValidationError) -> list[InputError]:
    """What a violation of the schema means, one error a key."""
    place, value = list(error.absolute_path), error.instance
    field, rule = _field(place), error.validator
    if rule == "additionalProperties":
        known = list(error.schema["properties"])
        unknown = [key for key in value if key not in known]
        return [_unknown(path, _field([*place, key]), str(key), known) for key in unknown]
    if rule == "required":
        properties = error.schema["properties"]
        return [
            InputError(
                path,
                _field([*place, key]),
                "missing",
                f"Give it: {properties[key].get('description', '')}",
            )
            for key in error.validator_value
            if key not in value
        ]
    if rule == "dependentRequired":
        return [
            InputError(path, _field([*place, other]), "missing", f"{key} needs {other} beside it")
            for key, others in error.validator_value.items()
            for other in others
            if key in value and other not in value
        ]
    if rule == "anyOf":
        keys = " or ".join(option["required"][0] for option in error.validator_value)
        return [InputError(path, field, f"has neither {keys}", f"Give {keys}")]
    description = error.schema.get("description", "")
    give = f"Give {description}" if description else "Correct it"
    if rule == "type":
        return [_wrong_type(path, field, value, error.validator_value, give)]
    if rule == "enum":
        choices = ", ".join(str(choice) for choice in error.validator_value)
        near = difflib.get_close_matches(str(value).lower(), error.validator_value, n=1)
        hint = f"Did you mean {near[0]}? " if near else ""
        problem = f"{shown(value)} is not known"
        return [InputError(path, field, problem, f"{hint}Choose one of: {choices}")]
    limits = {
        "minimum": "less than",
        "maximum": "more than",
        "exclusiveMinimum": "not more than",
        "exclusiveMaximum": "not less than",
    }
    if rule in limits:
        problem = f"{shown(value)} is {limits[rule]} {error.validator_value:g}"
    elif rule == "not":
        problem = f"{shown(value)} is not allowed"
    elif rule in ("minItems", "minLength"):
        problem = "empty"
    else:
        problem = error.message
    return [InputError(path, field, problem, give)]


def _unknown(path: Path, field: str, key: str, known: list[str]) -> InputError:
    near = difflib.get_close_matches(key, known, n=1)
    hint = f"Did you mean {near[0]}? " if near else ""
    return InputError(path, field, "unknown key", f"{hint}Known here: {', '.join(known)}")


def _wrong_type(path: Path, field: str, value, wanted: str | list[str], give: str) -> InputError:
    """A value of the wrong type, with what it may have been meant for."""
    kinds = [wanted] if isinstance(wanted, str) else wanted
    problem = f"{shown(value)} is not {' or '.join(TYPES[kind] for kind in kinds)}"
    if value is None:
        problem = "nothing is given"
    elif wanted in ("object", "array"):
        give = f"Give {TYPES[wanted]}"
    elif wanted == "string":
        give = (
            f'Put it in quotes: "{value}"'
            if not isinstance(value, bool)
            else ("Put it in quotes: YAML reads yes, no, on and off as true or false")
        )
    elif wanted in ("number", "integer") and isinstance(value, str):
        if value.lower() in NOT_FINITE:
            problem = f"{value} is not a finite number"
        elif _DECIMAL_COMMA.fullmatch(value):
            give = f"Write a decimal point: {value.replace(',', '.')}"
        elif _BASE_60.fullmatch(value):
            give = f"Write a decimal number; colons (base 60) are not read. {give}"
        elif unit := _WITH_UNIT.fullmatch(value):
            give = f"Give the number alone, as {unit[1]}, in SI units. {give}"
    return InputError(path, field, problem, give)


def shown(value: object) -> str:
    """A value as a message shows it, without its content where it is a list or a mapping."""
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list):
        return "a list"
    return repr(value)


def _field(parts) -> str:
    """recordings[0].file from ["recordings", 0, "file"]."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in parts)
    return text.lstrip(".") or "the whole file"
