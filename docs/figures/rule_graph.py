"""Draw the rules of a run and which needs which: docs/figures/rule_graph.svg.

    python docs/figures/rule_graph.py [--check]

The rules are those of `snakemake --configfile config/smoke.yaml`, as `snakemake --rulegraph` gives
them. A rule stands above all rules that need its output; arrows that follow from others are left
out. With --check nothing is written; the exit code is 1 where the picture is stale.
"""

from __future__ import annotations

import argparse
import io
import re
import subprocess
import sys
from pathlib import Path

from house import direct, floors, rows_of

ROOT = Path(__file__).resolve().parents[2]
PICTURE = Path(__file__).with_name("rule_graph.svg")

WIDTH, HEIGHT, GAP_X, GAP_Y = 1.75, 0.34, 0.14, 0.62  # inches: a box, and between boxes


def needs() -> dict[str, set[str]]:
    """Rule -> rules whose output it reads, without the target that only collects files."""
    command = [sys.executable, "-m", "snakemake", "--cores", "1", "--quiet"]
    command += ["--configfile", "config/smoke.yaml", "--config", "results=not_there", "--rulegraph"]
    graph = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    names = dict(re.findall(r'^\s*(\d+)\[label = "(\w+)', graph, re.M))
    found: dict[str, set[str]] = {name: set() for name in names.values()}
    for before, after in re.findall(r"^\s*(\d+) -> (\d+)", graph, re.M):
        found[names[after]].add(names[before])
    del found["all"]
    return found


def draw(arrows: dict[str, set[str]]) -> str:
    """The picture as SVG text, the same for the same rules."""
    import matplotlib
    from matplotlib.figure import Figure
    from matplotlib.patches import FancyBboxPatch

    matplotlib.rcParams.update({"svg.hashsalt": "rules", "svg.fonttype": "none"})
    reduced = direct(arrows)
    rows = rows_of(floors(arrows), reduced)
    width = (WIDTH + GAP_X) * max(map(len, rows)) + GAP_X
    height = (HEIGHT + GAP_Y) * len(rows)
    figure = Figure(figsize=(width, height))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, width), ylim=(0, height))
    axes.axis("off")
    at = {}
    for k, row in enumerate(rows):
        y = height - (HEIGHT + GAP_Y) * (k + 0.5) - 0.5 * HEIGHT
        share = width / len(row)
        for n, rule in enumerate(row):
            at[rule] = share * (n + 0.5), y
            axes.add_patch(
                FancyBboxPatch(
                    (at[rule][0] - 0.5 * WIDTH, y), WIDTH, HEIGHT,
                    boxstyle="round,pad=0.0,rounding_size=0.08",
                    facecolor="#eef3f8", edgecolor="#33506b",
                )
            )  # fmt: skip
            axes.text(
                at[rule][0], y + 0.5 * HEIGHT, rule, ha="center", va="center", fontsize=9.5,
                family="sans-serif", gid=f"rule-{rule}",
            )  # fmt: skip
    for rule, sources in reduced.items():
        for source in sorted(sources):
            axes.annotate(
                "", (at[rule][0], at[rule][1] + HEIGHT), at[source],
                arrowprops={"arrowstyle": "-|>", "color": "#8a4b2a", "lw": 1.0, "shrinkA": 0},
                zorder=0,
            )  # fmt: skip
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    return "\n".join(line.rstrip() for line in text.getvalue().splitlines()) + "\n"


def rules_drawn(text: str) -> set[str]:
    """Names of the rules in an SVG that `draw` made."""
    return set(re.findall(r'id="rule-(\w+)"', text))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="say whether the picture is stale")
    arguments = parser.parse_args()
    if arguments.check:
        return int(rules_drawn(PICTURE.read_text()) != set(needs()))
    PICTURE.write_text(draw(needs()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
