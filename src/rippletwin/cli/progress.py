"""What a command says on standard error: progress bars and warnings."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager


@contextmanager
def progress_bars(quiet: bool = False, passing: bool = False) -> Iterator[Callable]:
    """A function of (what, done, total) that draws one bar for each `what` on standard error.

    Nothing is drawn where standard error is no terminal. `passing` bars are for work that is
    mostly short: they appear after two seconds, and go when they are full.
    """
    from tqdm import tqdm

    bars: dict = {}

    def progress(what: str, done: int, total: int) -> None:
        if what not in bars:
            bars[what] = tqdm(
                total=total,
                desc=what,
                disable=True if quiet else None,
                leave=not passing,
                delay=2.0 if passing else 0.0,
            )
        bars[what].update(done - bars[what].n)
        if passing and done >= total:
            bars.pop(what).close()

    try:
        yield progress
    finally:
        for bar in bars.values():
            bar.close()


def warn(warnings: Iterable[str]) -> None:
    """Write warnings to standard error, a line each."""
    for warning in warnings:
        print(f"rippletwin: warning: {warning}", file=sys.stderr)
