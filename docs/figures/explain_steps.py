"""Draw the steps of explain from the headings of docs/explanation/explain.md.

    python docs/figures/explain_steps.py

A phase is a heading of the second level that has numbered steps, a step a heading of the third
level: "### 5. `search/single_effects.py`: what it does". Writes docs/figures/explain_steps.svg.
"""

from __future__ import annotations

import io
import re
import textwrap
from pathlib import Path

PAGE = Path(__file__).resolve().parents[1] / "explanation" / "explain.md"
PICTURE = Path(__file__).with_name("explain_steps.svg")
COLUMN, BOX_WIDTH, BOX_HEIGHT, GAP = 3.35, 2.9, 0.86, 0.26  # inches
WORDS = 34  # letters in a line of a box


def phases(page: str) -> dict[str, list[tuple[int, str, str]]]:
    """Phase -> (number, module, what it does) of its steps, in order."""
    found: dict[str, list[tuple[int, str, str]]] = {}
    phase = ""
    for line in page.splitlines():
        if heading := re.match(r"## (.*)$", line):
            phase = heading[1]
        elif step := re.match(r"### (\d+)\. `([\w/]+\.py)`: (.*)$", line):
            found.setdefault(phase, []).append((int(step[1]), step[2], step[3]))
    return found


def draw(page: str) -> str:
    """The picture as SVG text, the same for the same headings."""
    import matplotlib
    from matplotlib.figure import Figure
    from matplotlib.patches import FancyBboxPatch

    matplotlib.rcParams.update({"svg.hashsalt": "steps", "svg.fonttype": "none"})
    columns = phases(page)
    most = max(len(steps) for steps in columns.values())
    width, height = COLUMN * len(columns) + 0.2, most * (BOX_HEIGHT + GAP) + 0.9
    figure = Figure(figsize=(width, height))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, width), ylim=(0, height))
    axes.axis("off")
    for n, (phase, steps) in enumerate(columns.items()):
        left, top = 0.3 + COLUMN * n, height - 0.4
        axes.text(left, top, phase, weight="bold", fontsize=13, family="sans-serif")
        if n + 1 < len(columns):
            start, end = (left + 0.82 * BOX_WIDTH, top + 0.07), (left + COLUMN - 0.1, top + 0.07)
            arrow = {"arrowstyle": "-|>", "color": "#8a4b2a"}
            axes.annotate("", end, start, arrowprops=arrow)
        for k, (number, module, words) in enumerate(steps):
            bottom = top - 0.25 - (k + 1) * BOX_HEIGHT - k * GAP
            box = (left, bottom), BOX_WIDTH, BOX_HEIGHT
            style = "round,pad=0.0,rounding_size=0.08"
            axes.add_patch(
                FancyBboxPatch(*box, boxstyle=style, facecolor="#eef3f8", edgecolor="#33506b")
            )
            axes.text(
                left + 0.1, bottom + BOX_HEIGHT - 0.24, f"{number}. {module}", fontsize=9.5,
                weight="bold", family="sans-serif",
            )  # fmt: skip
            for m, line in enumerate(textwrap.wrap(words, WORDS)[:2]):
                axes.text(
                    left + 0.1, bottom + BOX_HEIGHT - 0.48 - 0.2 * m, line, fontsize=9,
                    family="sans-serif", color="#333333",
                )  # fmt: skip
            if k:
                x = left + 0.5 * BOX_WIDTH
                arrow = {"arrowstyle": "-|>", "color": "#8a4b2a", "shrinkA": 0, "shrinkB": 0}
                axes.annotate(
                    "", (x, bottom + BOX_HEIGHT), (x, bottom + BOX_HEIGHT + GAP), arrowprops=arrow
                )
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    return "\n".join(line.rstrip() for line in text.getvalue().splitlines()) + "\n"


if __name__ == "__main__":
    PICTURE.write_text(draw(PAGE.read_text()))
