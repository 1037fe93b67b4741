"""A physical parameter with its prior, and the coordinates in which every prior is N(0, 1).

Fits work in coordinates u. Then u = 0 is the data sheet, |u| is the pull on the prior in standard
deviations, and minus the logarithm of the prior density is u^2/2 for every parameter. A parameter
without a prior (`flat`) has a scale in its place and no pull.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rippletwin.effects.base import Prior


@dataclass(frozen=True)
class Parameter:
    """One unknown of a twin.

    name   unique, e.g. "wave_speed[2]" (segments count from 1)
    unit   SI
    prior  u -> value
    place  what it belongs to: "segment 2", "sensor p1", "load", "recording 1", an effect's label
    flat   no prior: `prior` is only the fit's coordinate
    """

    name: str
    unit: str
    prior: Prior
    place: str = ""
    flat: bool = False

    @property
    def nominal(self) -> float:
        """Value at u = 0."""
        return float(self.prior.value(0.0))

    def value(self, u: float) -> float:
        """Value in `unit` at coordinate u."""
        return self.prior.value(u)

    def value_sd(self, u: float, u_sd: float) -> float:
        """Standard deviation in `unit` of a coordinate known as u +- u_sd (first order)."""
        h = 1e-4
        return abs(float(self.value(u + h) - self.value(u - h))) / (2 * h) * u_sd


def values(parameters: Sequence[Parameter], u: np.ndarray) -> dict[str, float]:
    """Values by name at coordinates u (P,)."""
    return {p.name: float(p.value(x)) for p, x in zip(parameters, u, strict=True)}


def coordinates(parameters: Sequence[Parameter], by_name: Mapping[str, float]) -> np.ndarray:
    """Coordinates (P,) of values by name; a parameter that is not named stays at u = 0."""
    return np.array(
        [
            float(p.prior.coordinate(by_name[p.name])) if p.name in by_name else 0.0
            for p in parameters
        ]
    )
