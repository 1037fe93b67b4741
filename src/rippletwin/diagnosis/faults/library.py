"""The library of faults: every module of this package that defines `FAULT`, and users' files."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path

from rippletwin.case.python_file import read_object
from rippletwin.diagnosis import faults
from rippletwin.diagnosis.faults.base import Fault
from rippletwin.errors import InputError
from rippletwin.pump.faults import Cylinder, Slipper


def _discover() -> dict[str, Fault]:
    found = {}
    for module in pkgutil.iter_modules(faults.__path__):
        fault = getattr(importlib.import_module(f"{faults.__name__}.{module.name}"), "FAULT", None)
        if fault is not None:
            if fault.name in found:
                raise ValueError(f"two faults are called {fault.name!r}")
            found[fault.name] = fault
    # The order in diagnosis.json: slipper before cylinder.
    first = [name for name in ("slipper", "cylinder") if name in found]
    return {name: found[name] for name in [*first, *sorted(set(found) - set(first))]}


FAULTS: dict[str, Fault] = _discover()
"""Name -> fault, those that are not tried by default included."""


TRIED = 1e-7, 0, 9  # area, piston and number of pistons of a leak that a user's fault is tried at
LEAKS = "For area, piston and number of pistons it must return a list of Slipper and Cylinder"
FAULT_OF = {"S": "slipper", "C1": "cylinder", "C2": "cylinder"}
"""Class of the networks -> fault; the healthy class H has none."""


def select_faults(asked: Sequence[str | Path] = ()) -> tuple[Fault, ...]:
    """The faults to try: those tried by default, and those asked for by name or by file.

    Raises InputError for a name that is not known, and for a file without a usable `FAULT`.
    """
    chosen = [fault for fault in FAULTS.values() if fault.by_default]
    for each in asked:
        fault = FAULTS.get(str(each)) or read_fault(each)
        if fault.name in {other.name for other in chosen if other is not fault}:
            raise InputError(
                each, "FAULT", f"a second fault {fault.name!r}", "Give it its own name"
            )
        if fault not in chosen:
            chosen.append(fault)
    return tuple(chosen)


def find_fault(asked: str | Path) -> Fault | None:
    """The fault of this name or of this user's file, None for healthy; raises InputError where
    there is none."""
    return None if str(asked) == "healthy" else FAULTS.get(str(asked)) or read_fault(asked)


def read_fault(path: str | Path) -> Fault:
    """The `FAULT` of a user's Python file; raises InputError where there is none, and where its
    leaks are none of the pump model's."""
    fault = read_object(path, "FAULT", Fault, "fault", ", ".join(FAULTS))
    try:
        leaks = list(fault.leaks(*TRIED))
    except Exception as error:  # a user's code may raise anything
        raise InputError(path, "FAULT.leaks", f"fails: {error!r}", LEAKS) from error
    strangers = [leak for leak in leaks if not isinstance(leak, (Slipper, Cylinder))]
    if strangers or not leaks:
        found = f"{strangers[0]!r} is no leak of the pump model" if strangers else "gives no leak"
        raise InputError(path, "FAULT.leaks", found, LEAKS)
    return replace(fault, file=str(path))


def states_of(chosen: Sequence[Fault]) -> tuple[tuple[Fault, ...], ...]:
    """The states to tell apart: healthy, each fault alone, and two together."""
    return ((), *((fault,) for fault in chosen), *combinations(chosen, 2))


def state_name(state: Sequence[Fault]) -> str:
    """As in diagnosis.json: "healthy", "slipper", "slipper+cylinder"."""
    return "+".join(fault.name for fault in state) or "healthy"
