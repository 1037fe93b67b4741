"""The library of effects: every module of this package that defines `EFFECT` is one."""

from __future__ import annotations

import copyreg
import importlib
import pkgutil

from rippletwin.twin import effects
from rippletwin.twin.effects.base import Effect, Place


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
"""Name -> effect, those without a name included."""


def _by_name(name: str) -> Effect:
    return EFFECTS[name]


# An effect is pickled by its name: its functions may be lambdas, and every process has the library.
copyreg.pickle(Effect, lambda effect: (_by_name, (effect.name,)))


def candidates(rig, named: bool = True) -> list[tuple[Effect, Place]]:
    """Every effect that the rig's medium allows, at every place it can be.

    With `named` False the passive networks that represent physics without a name.
    """
    return [
        (effect, place)
        for effect in EFFECTS.values()
        if effect.named == named and effect.suits(rig)
        for place in effect.places(rig)
    ]
