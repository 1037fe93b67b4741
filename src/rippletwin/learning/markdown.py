"""Tables in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def markdown_table(heads: Sequence[str], lines: Iterable[Sequence]) -> str:
    """A table with a row for each of `lines`, whose cells are written as text on one line; "None."
    where there are no lines."""
    lines = list(lines)
    if not lines:
        return "None.\n"
    rows = [heads, ["---"] * len(heads), *lines]
    return "".join("| " + " | ".join(map(_cell, row)) + " |\n" for row in rows)


def _cell(content: object) -> str:
    """A cell's text, in which a bar or a line break would end the cell."""
    return " ".join(str(content).splitlines()).replace("|", "\\|")
