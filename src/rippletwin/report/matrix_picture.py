"""A table of counts as an SVG: rows are what is true, columns what was said, shades are shares."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

WIDTH = 400
LEFT, BOTTOM = 132, 92  # for the names of rows, and for those of columns
ROW = 22
MAX_SHADE = 0.5  # opacity of a whole row in one cell: numbers stay readable on it
NAME_LENGTH = 20  # characters of a name that fit


def draw_matrix(
    heading: str, rows: Sequence[str], columns: Sequence[str], counts: np.ndarray
) -> Markup:
    """Counts (R, C) of what is true, by what was said of it, as an <svg> element.

    Names are of rows and columns, in words. A cell's shade is its share of the row.
    """
    counts = np.asarray(counts)
    height = ROW * len(rows) + BOTTOM
    width = (WIDTH - LEFT - 8) / len(columns)
    share = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    parts = []
    for i, name in enumerate(rows):
        y = ROW * (i + 0.5)
        parts.append(_text(LEFT - 8, y, name, "end"))
        for j in range(len(columns)):
            x = LEFT + width * j
            parts.append(_cell(x, ROW * i, width, share[i, j]))
            if counts[i, j]:
                parts.append(_text(x + width / 2, y, str(counts[i, j]), "middle"))
    for j, name in enumerate(columns):
        x, y = LEFT + width * (j + 0.5), ROW * len(rows) + 12
        parts.append(
            Markup(
                '<text class="label" transform="translate({} {}) rotate(-40)" '
                'text-anchor="end">{}</text>'
            ).format(f"{x + 5:.1f}", y, _short(name))
        )
    said = [
        f"{name}: " + ", ".join(f"{told} {n}" for told, n in zip(columns, line) if n)
        for name, line in zip(rows, counts)
        if line.any()
    ]
    label = f"{heading}. True state, and how often each answer was given. {'; '.join(said)}"
    return Markup(
        '<svg class="matrix" viewBox="0 0 {} {}" role="img" aria-label="{}">{}</svg>'
    ).format(WIDTH, height, label, Markup("").join(parts))


def _cell(x: float, y: float, width: float, share: float) -> Markup:
    return Markup(
        '<rect class="cell" x="{}" y="{}" width="{}" height="{}" fill-opacity="{}"/>'
    ).format(f"{x:.1f}", y, f"{width:.1f}", ROW, f"{MAX_SHADE * share:.2f}")


def _text(x: float, y: float, words: str, anchor: str) -> Markup:
    return Markup(
        '<text class="label" x="{}" y="{}" dy="0.35em" text-anchor="{}">{}</text>'
    ).format(f"{x:.1f}", f"{y:.1f}", anchor, _short(words))


def _short(name: str) -> str:
    return name if len(name) <= NAME_LENGTH else name[: NAME_LENGTH - 1] + "…"
