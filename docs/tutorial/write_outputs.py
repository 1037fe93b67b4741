"""Write the outputs of the tutorials' commands into their pages.

    python docs/tutorial/write_outputs.py my_case own_rig

Both cases have been explained and diagnosed as the tutorials say. A block that is not given here is
shortened by hand. Numbers have four significant digits.
"""

from __future__ import annotations

import json
import re
import sys
import textwrap
from pathlib import Path

TUTORIALS = Path(__file__).parent
WIDTH = 118
MOST_ON_ONE_LINE = 130  # characters of a JSON object


def main(my_case: Path, own_rig: Path) -> None:
    """Write the blocks of both tutorials."""
    verdict = _read(my_case / "explained/verdict.json")
    first = {"verdict": verdict["verdict"], "mismatch": verdict["mismatch"]}
    for table in ("one_element_free", "source_informed_and_free"):  # long
        first["mismatch"]["where"].pop(table)
    effects = [_without_empty(effect) for effect in verdict["effects"]]
    _write(
        TUTORIALS / "first_verdict.md",
        {
            "sentence": ("text", _wrapped(verdict["sentence"])),
            "verdict": ("json", _as_json(first)),
            "effects": ("json", _as_json(effects)),
            "fit": ("json", _as_json(verdict["fit"])),
            "without": ("json", _as_json(verdict["without"])),
        },
    )
    own = _read(own_rig / "explained/verdict.json")
    diagnosed = _read(own_rig / "diagnosed/diagnosis.json")
    sentences = [recording["sentence"] for recording in diagnosed["recordings"]]
    _write(
        TUTORIALS / "own_rig.md",
        {
            "sentence": ("text", _wrapped(own["sentence"])),
            "diagnosis": ("text", _wrapped("\n".join([*sentences, "own_rig/report.html"]))),
        },
    )


def _write(page: Path, blocks: dict[str, tuple[str, str]]) -> None:
    """Replace the blocks of a page that are marked `<!-- output: NAME -->`."""
    text = page.read_text()
    for name, (language, content) in blocks.items():
        block = f"<!-- output: {name} -->\n```{language}\n{content}\n```\n<!-- end -->"
        marked = re.compile(rf"<!-- output: {name} -->.*?<!-- end -->", re.S)
        if len(marked.findall(text)) != 1:
            raise SystemExit(f"{page}: not one block is marked {name!r}")
        text = text.replace(marked.findall(text)[0], block)
    page.write_text(text)


def _read(file: Path) -> dict:
    return json.loads(file.read_text())


def _without_empty(effect: dict) -> dict:
    return {key: value for key, value in effect.items() if value not in (None, [])}


def _wrapped(text: str) -> str:
    lines = [textwrap.fill(line, WIDTH, break_on_hyphens=False) for line in text.split("\n")]
    return "\n".join(lines)


def _as_json(value, indent: int = 0) -> str:
    """JSON of rounded numbers, an object on one line where it fits and holds no other object."""
    if isinstance(value, float):
        return json.dumps(float(f"{value:.4g}"))
    if not isinstance(value, (dict, list)) or not value:
        return json.dumps(value)
    is_object = isinstance(value, dict)
    left, right = "{}" if is_object else "[]"
    names = [f"{json.dumps(key)}: " for key in value] if is_object else [""] * len(value)
    items = list(value.values()) if is_object else value
    parts = [name + _as_json(item, indent + 1) for name, item in zip(names, items)]
    line = f"{left}{', '.join(parts)}{right}"
    short = indent > 0 and len(line) + indent <= MOST_ON_ONE_LINE
    if short and "\n" not in line and not any(_holds_objects(item) for item in items):
        return line
    inner = ",\n".join(" " * (indent + 1) + part for part in parts)
    return f"{left}\n{inner}\n{' ' * indent}{right}"


def _holds_objects(item) -> bool:
    return isinstance(item, dict) or (isinstance(item, list) and any(map(_holds_objects, item)))


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
