"""The library of effects: every module of this package that defines `EFFECT`, and users' files."""

from __future__ import annotations

import copyreg
import importlib
import pkgutil
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from rippletwin.case.python_file import read_object
from rippletwin.errors import InputError
from rippletwin.twin import effects
from rippletwin.twin.effects.base import Effect, Place
from rippletwin.twin.effects.own_effects import check_fields, check_on_rig


def _discover() -> dict[str, Effect]:
    found = {}
    for module in pkgutil.iter_modules(effects.__path__):
        effect = getattr(
            importlib.import_module(f"{effects.__name__}.{module.name}"), "EFFECT", None
        )
        if effect is not None:
            if effect.name in found:
                raise ValueError(f"two effects are called {effect.name!r}")
            found[effect.name] = effect
    return found


EFFECTS: dict[str, Effect] = _discover()
"""Name -> effect, those without a name and those of users' files (`add_effects`) included."""


def add_effects(files: Iterable[str | Path], rig=None) -> tuple[Effect, ...]:
    """Take the effects of users' Python files into the library of this process.

    Processes that it forks know them too. A file that was taken before changes nothing. Raises
    InputError for a file without a usable `EFFECT`, for the name of another effect, and for an
    effect that does not work on `rig`, where one is given.
    """
    added = tuple(_add(read_effect(file)) for file in files)
    for effect in added if rig is not None else ():
        check_on_rig(effect, rig)
    return added


def _add(effect: Effect) -> Effect:
    known = EFFECTS.get(effect.name)
    if known is None:
        EFFECTS[effect.name] = effect
    elif known.file != effect.file:
        raise InputError(
            effect.file,
            "EFFECT.name",
            f"there is an effect {effect.name!r} already, in {known.file or 'the library'}",
            "Give it a name of its own",
        )
    return EFFECTS[effect.name]


def read_effect(path: str | Path) -> Effect:
    """The `EFFECT` of a user's Python file; raises InputError where there is none."""
    effect = read_object(path, "EFFECT", Effect, "--effects")
    effect = replace(effect, file=str(Path(path).resolve()))
    check_fields(effect)
    return effect


def find_effect(name: str, file: str | None = None) -> Effect:
    """The effect of that name; `file` is the user's file where it was defined once, if it was.

    Raises InputError where the library of this process does not have it.
    """
    if name in EFFECTS:
        return EFFECTS[name]
    raise InputError(
        file or "the library",
        "effects",
        f"the effect {name!r} is not known"
        + (f"; it was defined in a user's file called {file}" if file else ""),
        "Give its Python file with --effects FILE (in a workflow: explain.effects)",
    )


# An effect is pickled by its name: its functions may be lambdas, and every process has the library.
copyreg.pickle(Effect, lambda effect: (find_effect, (effect.name,)))


def candidates(rig, named: bool = True) -> list[tuple[Effect, Place]]:
    """Every effect that the rig's medium allows, at every place where it can act.

    With `named` False the passive networks that represent physics without a name.
    """
    return [
        (effect, place)
        for effect in EFFECTS.values()
        if effect.named == named and effect.suits(rig)
        for place in effect.places(rig)
    ]


def next_instance(
    candidate: tuple[Effect, Place], others: Sequence[tuple[Effect, Place]]
) -> tuple[Effect, Place] | None:
    """The candidate as it can join `others`; None where it is among them and has one place only.

    Of an effect at a free position a line may have several: they are numbered.
    """
    effect, place = candidate
    if place.element != "position":
        return None if candidate in others else candidate
    taken = {p.number for e, p in others if e is effect and p.form == place.form}
    number = next(n for n in range(1, len(taken) + 2) if n not in taken)
    return effect, replace(place, number=number)


def is_limit(special: tuple[Effect, Place], general: tuple[Effect, Place], rig) -> bool:
    """Whether an effect at its place is a limit of another, which then fits at least as well.

    It is the same effect with fewer parameters, or declared as a limit (`Effect.limits`).
    """
    (effect, place), (wide, at) = special, general
    if effect is wide:
        own = {p.name for p in effect.parameters(rig, place)}
        return place.element == at.element and own < {p.name for p in wide.parameters(rig, at)}
    return (effect.name, place.form) in _all_limits(wide)


def is_form_of(general: tuple[Effect, Place], special: tuple[Effect, Place], rig) -> bool:
    """Whether `general` is the same effect at the same element with more parameters.

    A line has one form of it there; at free positions it may have several.
    """
    same = general[0] is special[0] and general[1].element != "position"
    return same and is_limit(special, general, rig)


def generalisations(effect: Effect, place: Place) -> list[str]:
    """Names of the other effects that become this one at a limit."""
    return [e.name for e in EFFECTS.values() if (effect.name, place.form) in _all_limits(e)]


def _all_limits(effect: Effect) -> set[tuple[str, str | None]]:
    """The limits of an effect, those of its limits included."""
    found = set(effect.limits)
    for name, _ in effect.limits:
        if name in EFFECTS:
            found |= _all_limits(EFFECTS[name])
    return found
