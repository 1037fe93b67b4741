"""Tables in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def markdown_table(heads: Sequence[str], lines: Iterable[Sequence]) -> str:
    """A table with a row for each of `lines`, whose cells are written as text."""
    rows = [heads, ["---"] * len(heads), *lines]
    return "".join("| " + " | ".join(map(str, row)) + " |\n" for row in rows)
