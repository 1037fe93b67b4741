"""A physical parameter with its prior, and the coordinates in which every prior is N(0, 1).

Fits work in coordinates u: a positive quantity is `nominal * exp(sd * u)`, any other
`nominal + sd * u`. Then u = 0 is the data sheet, |u| is the pull on the prior in standard
deviations, and the Gaussian prior is the same for all: minus log density u^2/2. A parameter
without a prior (`flat`) has a scale in place of the standard deviation and no pull.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass

import numpy as np


@dataclass(frozen=True)
class Parameter:
    """One unknown of a model.

    name     unique, e.g. "wave_speed[2]" (segments and sensors count from 1)
    nominal  value of the data sheet, in `unit`
    sd       prior standard deviation: of the logarithm where `log`, else in `unit`
    flat     no prior; `sd` is only the scale of the fit's coordinate
    place    what it belongs to: "segment 2", "sensor p1", "load", "recording 1", an effect's name
    """

    name: str
    nominal: float
    sd: float
    unit: str = ""
    log: bool = True
    flat: bool = False
    place: str = ""

    def __post_init__(self):
        if not self.sd > 0.0:
            raise ValueError(f"{self.name}: the prior standard deviation must be positive")
        if self.log and not self.nominal > 0.0:
            raise ValueError(f"{self.name}: a logarithmic parameter must be positive")

    def value(self, u: float) -> float:
        """Value in `unit` at coordinate u."""
        shift = self.sd * u
        return self.nominal * float(np.exp(shift)) if self.log else self.nominal + shift

    def coordinate(self, value: float) -> float:
        """Coordinate of a value in `unit`; ValueError for a value <= 0 of a positive parameter."""
        if self.log:
            if not value > 0.0:
                raise ValueError(f"{self.name} must be positive, not {value}")
            return float(np.log(value / self.nominal)) / self.sd
        return (value - self.nominal) / self.sd

    def value_sd(self, u: float, u_sd: float) -> float:
        """Standard deviation in `unit` of a coordinate known as u +- u_sd (first order)."""
        return self.sd * u_sd * (self.value(u) if self.log else 1.0)

    def to_dict(self) -> dict:
        """Plain numbers and text; `Parameter(**d)` reads it back."""
        return asdict(self)


def values(parameters: Sequence[Parameter], u: np.ndarray) -> dict[str, float]:
    """Values by name at coordinates u (P,)."""
    return {p.name: p.value(float(x)) for p, x in zip(parameters, u, strict=True)}


def coordinates(parameters: Sequence[Parameter], by_name: Mapping[str, float]) -> np.ndarray:
    """Coordinates (P,) of values by name; a parameter that is not named stays nominal."""
    return np.array(
        [p.coordinate(by_name[p.name]) if p.name in by_name else 0.0 for p in parameters]
    )


def has_prior(parameters: Sequence[Parameter]) -> np.ndarray:
    """(P,) bool: which parameters have a prior."""
    return np.array([not p.flat for p in parameters], dtype=bool)
