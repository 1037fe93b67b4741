"""The pages of the documentation and the fenced blocks in them."""

from __future__ import annotations

import re
import textwrap
from dataclasses import dataclass
from pathlib import Path

from paths import ROOT

PAGES = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    ROOT / "config" / "README.md",
    *sorted((ROOT / "docs").rglob("*.md")),
]
LONG = "<!-- long -->"


@dataclass(frozen=True)
class Block:
    """A fenced block: its page relative to the repository, the line of its fence, its language,
    its text, and whether the line before the fence marks it as long."""

    page: str
    line: int
    language: str
    text: str
    long: bool

    @property
    def commands(self) -> list[str]:
        """Command lines, continued lines joined, comments and empty lines left out."""
        joined = self.text.replace("\\\n", " ")
        lines = [re.sub(r"(^|\s+)#.*$", "", line).strip() for line in joined.splitlines()]
        return [re.sub(r"\s+", " ", line) for line in lines if line]

    def __str__(self) -> str:
        return f"{self.page}:{self.line}"


def blocks_of(page: Path) -> list[Block]:
    """Fenced blocks of a page, in order. Raises ValueError where a fence is not closed."""
    found, opened, before = [], None, ""
    for number, line in enumerate(page.read_text().splitlines(), 1):
        fence = re.match(r"^\s*```(\w*)\s*$", line)
        if opened is None and fence:
            opened = number, fence[1], [], before == LONG
        elif opened is not None and fence:
            start, language, lines, long = opened
            name = str(page.relative_to(ROOT))
            text = textwrap.dedent("\n".join(lines)) + "\n"
            found.append(Block(name, start, language, text, long))
            opened = None
        elif opened is not None:
            opened[2].append(line)
        before = line.strip()
    if opened is not None:
        raise ValueError(f"{page}: the fence in line {opened[0]} is not closed")
    return found


def prose_of(page: Path) -> str:
    """Text of a page without its fenced blocks."""
    return re.sub(r"(?ms)^\s*```.*?^\s*```\s*$", "", page.read_text())


def blocks(language: str) -> list[Block]:
    """All blocks of one language, on all pages."""
    return [block for page in PAGES for block in blocks_of(page) if block.language == language]
