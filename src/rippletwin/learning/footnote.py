"""The mark of numbers whose trainings did not all converge."""

from __future__ import annotations

UNCONVERGED = "†"


def mark_unconverged(text: str, converged: bool = True) -> str:
    """The text of a number, marked where not all trainings behind it converged."""
    return text if converged else f"{text} {UNCONVERGED}"


def with_footnote(page: str) -> str:
    """A page or table with what the mark means, where it has one."""
    note = f"\n{UNCONVERGED} Not every training behind this number met the convergence rule.\n"
    return page + note if UNCONVERGED in page else page
