"""What a fault is: leaks of the pump model, with a prior on their area.

A fault is one file in this folder that defines `FAULT`, an instance of `Fault`; the registry finds
it there. A file of the user's own that defines `FAULT` counts just as well.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from rippletwin.pump.faults import Cylinder, Slipper

SMALLEST, LARGEST = 0.002, 4.0
"""Ends of a log-uniform prior on a leak's flow under the load pressure, over the mean flow of one
piston: from below 1 % of a healthy ripple to several times that ripple."""
OTHER_STATES = ("healthy", "unlike", "unknown")


@dataclass(frozen=True)
class Fault:
    """A fault hypothesis.

    name          as in diagnosis.json
    words         what it is, for the sentence: "a worn slipper"
    leaks         (leak area m2, piston, number of pistons) -> the pump model's faults
    source        author, year and section, or why it is so
    smallest, largest   ends of the log-uniform prior on the leak's flow under the load pressure,
                  over the mean flow of one piston
    one_piston    whether it is at one piston; else all pistons are alike
    by_default    whether it is tried unless asked for otherwise
    file          the user's file that defines it; None in the library

    Raises ValueError unless 0 < smallest < largest, and for the name of another state.
    """

    name: str
    words: str
    leaks: Callable[[float, int, int], Sequence[Slipper | Cylinder]]
    source: str
    smallest: float = SMALLEST
    largest: float = LARGEST
    one_piston: bool = True
    by_default: bool = True
    file: str | None = None

    def __post_init__(self):
        if self.name in OTHER_STATES or "+" in self.name:
            raise ValueError(
                f"a fault cannot be called {self.name!r}: other states have such names"
            )
        if not 0.0 < self.smallest < self.largest:
            raise ValueError(f"fault {self.name!r}: 0 < smallest < largest must hold")
