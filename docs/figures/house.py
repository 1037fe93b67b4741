"""Draw the rooms of `src/rippletwin` and who imports whom: docs/figures/house.svg.

    python docs/figures/house.py [--check]

A room is a package of `src/rippletwin` or one of its loose files. Imports are read from the source
with `ast`, those inside functions included. A room stands on the lowest floor that is above all the
rooms it imports. With --check nothing is written; the exit code is 1 where the picture is stale.
"""

from __future__ import annotations

import argparse
import ast
import io
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SOURCE = ROOT / "src" / "rippletwin"
PICTURE = Path(__file__).with_name("house.svg")
PACKAGE = SOURCE.name

ROOM_WIDTH, LINE_HEIGHT, FLOOR_GAP = 3.0, 0.26, 0.75  # inches


def rooms(source: Path = SOURCE) -> dict[str, list[str]]:
    """Room -> its parts (modules, and sub-packages with a slash), in alphabetical order."""
    found = {}
    for path in sorted(source.iterdir()):
        if path.is_dir() and (path / "__init__.py").exists():
            inside = [p for p in sorted(path.iterdir()) if not p.name.startswith("__")]
            found[path.name] = [
                f"{p.name}/" if p.is_dir() else p.stem
                for p in inside
                if (p.is_dir() and (p / "__init__.py").exists()) or p.suffix == ".py"
            ]
        elif path.suffix == ".py" and not path.name.startswith("__"):
            found[path.stem] = []
    return found


def imports(source: Path = SOURCE) -> dict[str, set[str]]:
    """Room -> the other rooms that its modules import."""
    names = rooms(source)
    found: dict[str, set[str]] = {room: set() for room in names}
    for path in source.rglob("*.py"):
        room = path.relative_to(source).parts[0].removesuffix(".py")
        if room not in names:
            continue  # the package's own __init__
        for node in ast.walk(ast.parse(path.read_text())):
            targets = []
            if isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
                targets = [f"{node.module}.{alias.name}" for alias in node.names]
            elif isinstance(node, ast.Import):
                targets = [alias.name for alias in node.names]
            for target in targets:
                parts = target.split(".")
                if parts[0] == source.name and len(parts) > 1 and parts[1] in names:
                    found[room].add(parts[1])
    return {room: targets - {room} for room, targets in found.items()}


def floors(arrows: dict[str, set[str]]) -> dict[str, int]:
    """Room -> floor, 0 for rooms that import no other. Raises ValueError at a circle."""
    found: dict[str, int] = {}

    def floor(room: str, way: tuple[str, ...]) -> int:
        if room in way:
            raise ValueError(f"rooms import each other: {' -> '.join((*way, room))}")
        if room not in found:
            found[room] = max((floor(r, (*way, room)) + 1 for r in arrows[room]), default=0)
        return found[room]

    for room in arrows:
        floor(room, ())
    return found


def direct(arrows: dict[str, set[str]]) -> dict[str, set[str]]:
    """The arrows without those that a longer way shows already (transitive reduction)."""

    def reach(room: str) -> set[str]:
        return {room}.union(*(reach(r) for r in arrows[room]))

    return {
        room: {r for r in targets if not any(r in reach(other) for other in targets if other != r)}
        for room, targets in arrows.items()
    }


def rows_of(level: dict[str, int], arrows: dict[str, set[str]]) -> list[list[str]]:
    """Rooms of each floor from left to right, each about below the rooms that import it."""
    rows: list[list[str]] = []
    at: dict[str, float] = {}
    for k in range(max(level.values()), -1, -1):
        row = sorted(r for r in level if level[r] == k)
        above = {r: [at[o] for o, targets in arrows.items() if r in targets] for r in row}
        # A room that nobody imports stands at the right.
        row.sort(key=lambda r: sum(above[r]) / len(above[r]) if above[r] else 1.0)
        at |= {r: (n + 1.0) / (len(row) + 1.0) for n, r in enumerate(row)}
        rows.insert(0, row)
    return rows


def draw() -> str:
    """The picture as SVG text, the same for the same source."""
    import matplotlib
    from matplotlib.figure import Figure
    from matplotlib.patches import FancyBboxPatch

    matplotlib.rcParams.update({"svg.hashsalt": "house", "svg.fonttype": "none"})
    parts, arrows = rooms(), imports()
    level = floors(arrows)
    rows = rows_of(level, direct(arrows))
    heights = [max(LINE_HEIGHT * (len(lines_of(parts[r])) + 1.8) for r in row) for row in rows]
    width = ROOM_WIDTH * 1.12 * max(len(row) for row in rows) + 0.4
    height = sum(heights) + FLOOR_GAP * len(rows) + 0.4
    figure = Figure(figsize=(width, height))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, width), ylim=(0, height))
    axes.axis("off")
    boxes, y = {}, 0.3
    for row, tall in zip(rows, heights):
        left = 0.5 * (width - 1.12 * ROOM_WIDTH * len(row))
        for k, room in enumerate(row):
            x = left + ROOM_WIDTH * (1.12 * k + 0.06)
            own = LINE_HEIGHT * (len(lines_of(parts[room])) + 1.8)
            boxes[room] = x, y, own
            patch = FancyBboxPatch(
                (x, y), ROOM_WIDTH, own, boxstyle="round,pad=0.0,rounding_size=0.08",
                facecolor="#eef3f8" if parts[room] else "#f7f3ea", edgecolor="#33506b",
            )  # fmt: skip
            axes.add_patch(patch)
            middle = x + 0.5 * ROOM_WIDTH
            axes.text(
                middle, y + own - 0.3, room, ha="center", weight="bold", gid=f"room-{room}",
                fontsize=13, family="sans-serif",
            )  # fmt: skip
            for n, line in enumerate(lines_of(parts[room])):
                axes.text(
                    middle, y + own - 0.62 - LINE_HEIGHT * n, line, ha="center", fontsize=9.5,
                    family="sans-serif", color="#333333",
                )  # fmt: skip
        y += tall + FLOOR_GAP
    for room, targets in direct(arrows).items():
        x0, y0, _ = boxes[room]
        for target in sorted(targets):
            x1, y1, tall = boxes[target]
            axes.annotate(
                "", (x1 + 0.5 * ROOM_WIDTH, y1 + tall), (x0 + 0.5 * ROOM_WIDTH, y0),
                arrowprops={"arrowstyle": "-|>", "color": "#8a4b2a", "lw": 1.1, "shrinkA": 0},
                gid=f"arrow-{room}-{target}", zorder=0,
            )  # fmt: skip
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    return "\n".join(line.rstrip() for line in text.getvalue().splitlines()) + "\n"


def lines_of(names: list[str], width: int = 40) -> list[str]:
    """Names in lines of at most `width` letters."""
    lines: list[str] = []
    for name in names:
        if lines and len(lines[-1]) + len(name) + 2 <= width:
            lines[-1] += f", {name}"
        else:
            lines.append(name)
    return lines


def rooms_drawn(text: str) -> set[str]:
    """Names of the rooms in an SVG that `draw` made."""
    return set(re.findall(r'id="room-(\w+)"', text))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="say whether the picture is stale")
    if parser.parse_args().check:
        return int(rooms_drawn(PICTURE.read_text()) != set(rooms()))
    PICTURE.write_text(draw())
    return 0


if __name__ == "__main__":
    sys.exit(main())
