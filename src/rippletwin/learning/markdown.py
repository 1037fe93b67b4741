"""Tables in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def markdown_table(heads: Sequence[str], lines: Iterable[Sequence]) -> str:
    """A table with a row for each of `lines`, whose cells are written as text."""
    rows = [heads, ["---"] * len(heads), *lines]
    return "".join("| " + " | ".join(map(str, row)) + " |\n" for row in rows)


UNCONVERGED = "†"  # beside a number of networks whose trainings did not all converge


def mark_unconverged(text: str, converged: bool = True) -> str:
    """The text of a number, marked where not all trainings behind it converged."""
    return text if converged else f"{text} {UNCONVERGED}"


def with_footnote(page: str) -> str:
    """A page or table with what the mark means, where it has one."""
    note = f"\n{UNCONVERGED} Not every training behind this number met the convergence rule.\n"
    return page + note if UNCONVERGED in page else page
