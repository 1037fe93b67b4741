"""rig.yaml: parse it and hold it against its schema."""

from __future__ import annotations

import difflib
import re
from functools import cache
from importlib import resources
from pathlib import Path

import jsonschema
import yaml

from rippletwin.errors import InputError

_FLOAT = re.compile(r"^[-+]?(\d[\d_]*\.?[\d_]*|\.\d[\d_]*)([eE][-+]?\d+)?$")


class _Loader(yaml.SafeLoader):
    """YAML as people write it: 9.5e6 is a number, a key given twice is an error."""

    yaml_implicit_resolvers = {  # noqa: RUF012
        first: [(tag, pattern) for tag, pattern in resolvers if tag != "tag:yaml.org,2002:float"]
        for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
    }

    def construct_mapping(self, node, deep=False):
        seen = set()
        for key, _ in node.value:
            if str(key.value) in seen:
                raise yaml.constructor.ConstructorError(
                    None, None, f"the key {key.value!r} is given twice", key.start_mark
                )
            seen.add(str(key.value))
        return super().construct_mapping(node, deep)


# YAML 1.1 reads 9.5e6 as text; .nan and .inf stay text here so that the schema refuses them.
_Loader.add_implicit_resolver("tag:yaml.org,2002:float", _FLOAT, list("-+0123456789."))


@cache
def schema() -> dict:
    """The JSON schema of rig.yaml."""
    text = resources.files("rippletwin.case").joinpath("rig.schema.yaml").read_text("utf-8")
    return yaml.safe_load(text)


def read_sheet(path: Path) -> dict:
    """Parse and validate `path` (a rig.yaml); raises InputError at the first fault."""
    if not path.is_file():
        raise InputError(
            path,
            "rig.yaml",
            "not there",
            "A case is a folder that holds a rig.yaml; see docs/cases.md",
        )
    try:
        sheet = yaml.load(path.read_text("utf-8"), Loader=_Loader)
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        mark = getattr(error, "problem_mark", None)
        place = f"line {mark.line + 1}, column {mark.column + 1}" if mark else "the whole file"
        problem = getattr(error, "problem", None) or str(error)
        raise InputError(path, place, f"not YAML: {problem}", "Correct the syntax there") from error
    errors = jsonschema.Draft202012Validator(schema()).iter_errors(sheet)
    first = min(errors, key=lambda error: [str(part) for part in error.absolute_path], default=None)
    if first is not None:
        raise _explained(path, first)
    return sheet


def _explained(path: Path, error: jsonschema.ValidationError) -> InputError:
    """The InputError that says what a schema violation means."""
    field = _field(error.absolute_path)
    rule, value = error.validator, error.instance
    if rule == "additionalProperties":
        known = list(error.schema["properties"])
        unknown = [key for key in value if key not in known]
        field = ", ".join(_field([*error.absolute_path, key]) for key in unknown)
        near = difflib.get_close_matches(str(unknown[0]), known, n=1)
        hint = f"Did you mean {near[0]}? " if near else ""
        return InputError(path, field, "unknown key", f"{hint}Known here: {', '.join(known)}")
    if rule == "required":
        missing = [key for key in error.validator_value if key not in value]
        field = _field([*error.absolute_path, missing[0]])
        described = error.schema["properties"][missing[0]].get("description", "")
        return InputError(path, field, "missing", f"Give it: {described}")
    description = error.schema.get("description", "")
    if rule == "type" and isinstance(value, str) and value.lower() in {".nan", ".inf", "-.inf"}:
        return InputError(path, field, f"{value} is not a finite number", f"Give {description}")
    if rule == "enum":
        choices = ", ".join(str(choice) for choice in error.validator_value)
        return InputError(path, field, f"{value!r} is not known", f"Choose one of: {choices}")
    return InputError(path, field, error.message, f"Give {description}" if description else "")


def _field(parts) -> str:
    """recordings[0].file from ["recordings", 0, "file"]."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in parts)
    return text.lstrip(".") or "the whole file"
