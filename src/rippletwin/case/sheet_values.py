"""Values of a sheet that may still violate its schema: only those of the right type are seen."""

from __future__ import annotations

import math
from collections.abc import Iterator


def leaves(value: object, field: str = "") -> Iterator[tuple[str, object]]:
    """(field, value) of everything in a sheet that is neither a list nor a mapping.

    Fields are written as in messages: recordings[0].file.
    """
    if isinstance(value, dict):
        for key, part in value.items():
            yield from leaves(part, f"{field}.{key}" if field else str(key))
    elif isinstance(value, list):
        for index, part in enumerate(value):
            yield from leaves(part, f"{field}[{index}]")
    else:
        yield field, value


def mapping(sheet: object, key: str) -> dict:
    """The mapping under a key; empty where there is none."""
    value = sheet.get(key) if isinstance(sheet, dict) else None
    return value if isinstance(value, dict) else {}


def entries(sheet: dict, key: str) -> list[dict]:
    """The mappings in the list under a key; one that is no mapping stands as an empty one."""
    value = sheet.get(key)
    return [e if isinstance(e, dict) else {} for e in value] if isinstance(value, list) else []


def number(sheet: dict, key: str) -> float | None:
    """The finite number under a key; None where there is none."""
    value = sheet.get(key)
    good = isinstance(value, (int, float)) and not isinstance(value, bool)
    return float(value) if good and math.isfinite(value) else None


def line_length(sheet: dict) -> float | None:
    """Length of the line, m; None where a segment's is not a number."""
    lengths = [number(segment, "length") for segment in entries(mapping(sheet, "line"), "segments")]
    return None if not lengths or None in lengths else sum(lengths)
