"""The library of effects: every file of this folder that defines `EFFECT` is one."""

from __future__ import annotations

import importlib
import pkgutil

from rippletwin.effects.base import Effect, LineState, Parameter, Place, Prior

__all__ = ["EFFECTS", "Effect", "LineState", "Parameter", "Place", "Prior", "candidates"]


def _discover() -> dict[str, Effect]:
    found = {}
    for module in pkgutil.iter_modules(__path__):
        effect = getattr(importlib.import_module(f"{__name__}.{module.name}"), "EFFECT", None)
        if effect is not None:
            if effect.name in found:
                raise ValueError(f"two effects are called {effect.name!r}")
            found[effect.name] = effect
    return found


EFFECTS: dict[str, Effect] = _discover()
"""Name -> effect, those without a name included."""


def candidates(rig, named: bool = True) -> list[tuple[Effect, Place]]:
    """Every effect that the rig's medium allows, at every place it can be.

    With `named` False the passive networks that stand in for effects without a name.
    """
    return [
        (effect, place)
        for effect in EFFECTS.values()
        if effect.named == named and effect.suits(rig)
        for place in effect.places(rig)
    ]
