"""An effect as drawn for a concealed case, and what drawing it needs to know of its rig."""

from dataclasses import asdict, dataclass, field

import numpy as np

MIN_DISTANCE = 0.2
"""Metres between a place and joints, ends or other places: short pipes need small time steps."""


@dataclass(frozen=True)
class DrawnEffect:
    """An effect as drawn.

    `arguments` are those of the rig's effect (`virtualrig.effects`). `element` and `parameters`
    (name -> true value, SI units) use the words of a verdict. `position` is in m from the pump
    outlet, None where the effect has none. `level` is its strength between the weakest (0) and the
    strongest (1) on a logarithmic scale, None where it has no strength.
    """

    name: str
    element: str
    arguments: dict
    level: float | None
    position: float | None = None
    parameters: dict[str, float] = field(default_factory=dict)

    def to_dict(self) -> dict:
        return asdict(self)

    @property
    def entry(self) -> dict:
        """Its entry in a seal's `effects`."""
        return {"name": self.name, **self.arguments}


@dataclass
class RigContext:
    """What drawing an effect needs to know of its rig.

    `segments` are the true ones; `sensors` is their number; `density` in kg/m3; `modulus` in Pa is
    that by which the rig turns a volume into a compliance; `flow` (m3/s) and `pressure` (Pa) are
    means over the operating points; `taken` are the positions in use, m.
    """

    rng: np.random.Generator
    segments: list[dict]
    sensors: int
    density: float
    modulus: float
    flow: float
    pressure: float
    taken: list[float] = field(default_factory=list)

    def uniform(self, low: float, high: float) -> float:
        return float(self.rng.uniform(low, high))

    def log_uniform(self, low: float, high: float) -> float:
        return float(low * (high / low) ** self.rng.uniform())

    @property
    def length(self) -> float:
        return sum(segment["length"] for segment in self.segments)

    def draw_position(self) -> float:
        """A position on the line, away from what is there; it is then taken.

        Raises RuntimeError where a thousand draws find no room.
        """
        ends = np.concatenate([[0.0], np.cumsum([s["length"] for s in self.segments])])
        for _ in range(1000):
            position = self.uniform(0.0, self.length)
            if np.abs(np.array([*ends, *self.taken]) - position).min() > MIN_DISTANCE:
                self.taken.append(position)
                return position
        raise RuntimeError("no room on the line")

    def segment_at(self, position: float) -> int:
        """Index of the segment that holds `position`."""
        ends = np.cumsum([s["length"] for s in self.segments])
        return int(min(np.searchsorted(ends, position), len(ends) - 1))

    def stiffness(self, k: int) -> float:
        """rho a^2 of segment k, Pa."""
        return self.density * self.segments[k]["wave_speed"] ** 2

    def volume_scale(self, k: int) -> float:
        """Cube of segment k's diameter over 20 mm: volumes are drawn in proportion to it."""
        return (self.segments[k]["diameter"] / 0.02) ** 3


def log_between(weak: float, strong: float, level: float) -> float:
    """The value at `level` (0 to 1) between two ends, on a logarithmic scale."""
    return weak * (strong / weak) ** level
