"""The base of all effects: a piece of physics that a twin may lack, and its places on a rig.

An effect is one file in this folder that defines `EFFECT`, an instance of `Effect`; `library` finds
it there. It states the same physics twice: `apply` changes a `FrequencyDomainLine`, `apply_in_time`
a `TimeDomainLine` (its pipes, elements, flow or sensors).

For `apply`, values are floats or arrays of shape (B, 1) for B parameter sets at once. Everything
there is elementwise, so that the same statements change a line with a leading batch dimension.
`apply_in_time` gets floats and the `LineState` of one operating point.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from rippletwin.case.model import Rig, absolute
from rippletwin.twin.parameters import Parameter
from rippletwin.twin.priors import uniform


@dataclass(frozen=True)
class Place:
    """Where an effect acts.

    element  as in a verdict: "line", "segment 2" (counted from 1), "position", "load", "source",
             "sensor p1"
    index    of the segment or sensor, from 0; None elsewhere
    form     the variant where an effect has several equations, else None
    number   which of several of one effect at free positions, from 1
    """

    element: str
    index: int | None = None
    form: str | None = None
    number: int = 1

    def __str__(self) -> str:
        form = "" if self.form is None else f" ({self.form})"
        return f"{self.element}{form}" + (f" {self.number}" if self.number > 1 else "")


@dataclass
class LineState:
    """The quantities of a line that effects use; each may have a batch dimension (B, 1).

    density          kg/m3
    viscosity        kinematic, m2/s, (..., F) or scalar: each recording's own
    friction         law of the line with all its effects, as in `series_impedance`
    diameters, lengths   (n,) of m, wave_speeds (n,) of m/s: one entry a segment, pump first
    mean_pressure    Pa at the load, (F,) or scalar: each frequency's own operating point's
    load_resistance  static dp/dq of the load in Pa s/m3, (F,) or scalar; None where it has none
    heat_capacity_ratio, prandtl   of a gas, else None
    orders, recording, mean_flow   shaft order, recording's number and mean flow (m3/s) of each
                     frequency, (F,); None where there is no shaft
    load_passes_flow whether the load's coefficient is calculated from that mean flow: a flow that
                     leaves the line before the load must be subtracted
    effects          (effect, place) of all that act on the line
    """

    density: float
    viscosity: np.ndarray | float
    diameters: np.ndarray
    wave_speeds: np.ndarray
    lengths: np.ndarray
    mean_pressure: np.ndarray | float = 0.0
    load_resistance: np.ndarray | float | None = None
    heat_capacity_ratio: float | None = None
    prandtl: float | None = None
    orders: np.ndarray | None = None
    recording: np.ndarray | None = None
    mean_flow: np.ndarray | None = None
    load_passes_flow: bool = False
    friction: str = "steady"
    effects: Sequence[tuple[Effect, Place]] = ()

    def area(self, k: int):
        """Cross section of segment k, m2."""
        return 0.25 * np.pi * self.diameters[k] ** 2

    def absolute_pressure_in(self, k: int):
        """Mean pressure in the middle of segment k, Pa absolute."""
        return self._absolute_pressure(k, 0.5)

    def absolute_pressure_at(self, position: float):
        """Mean pressure at `position`, m, Pa absolute."""
        k = segment_at(self.lengths, position)
        behind = np.sum(self.lengths[: k + 1], axis=0) - position
        return self._absolute_pressure(k, np.clip(behind / self.lengths[k], 0.0, 1.0))

    def _absolute_pressure(self, k: int, share):
        """Mean pressure where `share` of segment k is behind, Pa absolute.

        Steady laminar friction of the mean flow lifts it above that at the load (Hagen-Poiseuille).
        """
        if self.mean_flow is None or self.friction == "none":
            return absolute(self.mean_pressure)
        behind = sum(self._fall(j) for j in range(k + 1, len(self.lengths)))
        rise = (share * self._fall(k) + behind) * np.nan_to_num(self.mean_flow)
        return absolute(self.mean_pressure) + rise

    def _fall(self, k: int):
        """Pressure that a flow loses in segment k, over the flow, Pa s/m3."""
        dynamic = self.density * self.viscosity
        return 32.0 * dynamic * self.lengths[k] / (self.area(k) * self.diameters[k] ** 2)


@dataclass(frozen=True, eq=False)
class Effect:
    """A piece of physics that a twin may lack.

    name        as in a verdict
    element     kind of element it acts on: line, segment, position, load, source or sensor
    medium      "liquid", "gas" or "any"
    equation    in plain text
    source      author, year and equation or section
    parameters  (rig, place) -> tuple of Parameter
    places      rig -> tuple of Place
    apply       (network: FrequencyDomainLine, state: LineState, values: name -> value, place)
                mutates the network
    apply_in_time   (line: TimeDomainLine, state: LineState, values, place) mutates the line; None
                where the time domain follows from `apply` (`rippletwin.twin.time_domain_form`)
    named       False for a passive network that represents physics without a name
    certain     (rig, place) -> whether it is always present there: accepted with any other effect
                unless the data contradict it
    usual       (rig, place) -> whether it is in nearly all real lines: the search tries it before
                all others
    friction    law by which it replaces the line's, as in `series_impedance`
    limits      (name, form) of effects that this one becomes at a limit of its parameters or at an
                end of the line; what those are limits of, it is too
    rank        effects of a higher one act on the line that those of a lower one leave
    immittances (network, state, values, place) -> immittances per metre of what it puts in place of
                a stretch of the line; None for one-ports, whose inserts say whether it is passive
    describe    values -> what it is like, in words; None where a law against frequency says it
    file        the user's file that defines it; None in the library
    """

    name: str
    element: str
    medium: str
    equation: str
    source: str
    parameters: Callable[[Rig, Place], tuple[Parameter, ...]]
    places: Callable[[Rig], tuple[Place, ...]]
    apply: Callable[[object, LineState, Mapping[str, object], Place], None]
    apply_in_time: Callable[[object, LineState, Mapping[str, float], Place], None] | None = None
    certain: Callable[[Rig, Place], bool] = lambda rig, place: False
    usual: Callable[[Rig, Place], bool] = lambda rig, place: False
    named: bool = True
    friction: str | None = None
    limits: tuple[tuple[str, str | None], ...] = ()
    rank: int = 0
    immittances: Callable[[object, LineState, Mapping[str, object], Place], Sequence] | None = None
    describe: Callable[[Mapping[str, object]], str] | None = None
    file: str | None = None

    def suits(self, rig) -> bool:
        """Whether the effect exists in the rig's medium."""
        gas = rig.fluid.heat_capacity_ratio is not None
        return self.medium == "any" or (self.medium == "gas") == gas


def line_place(rig) -> tuple[Place, ...]:
    """The whole line."""
    return (Place("line"),)


def segment_places(rig) -> tuple[Place, ...]:
    """Each segment."""
    return tuple(Place(f"segment {k + 1}", k) for k in range(len(rig.line)))


def position_place(rig) -> tuple[Place, ...]:
    """Anywhere along the line: `position` is a parameter then."""
    return (Place("position"),)


def load_place(rig) -> tuple[Place, ...]:
    """The load."""
    return (Place("load"),)


def source_place(rig) -> tuple[Place, ...]:
    """The pump."""
    return (Place("source"),)


def sensor_places(rig) -> tuple[Place, ...]:
    """Each sensor."""
    return tuple(Place(f"sensor {sensor.name}", k) for k, sensor in enumerate(rig.sensors))


def position_parameter(rig) -> Parameter:
    """Distance from the pump outlet, m, uniform over the line; fits start from twelve positions."""
    prior = uniform(0.0, sum(s.length for s in rig.line))
    return Parameter("position", "m", prior, tuple(ndtri((np.arange(12) + 0.5) / 12)))


def segment_at(lengths: np.ndarray, position) -> int:
    """Index of the segment that holds `position`, m, in a line of segments of `lengths` (n,), m; of
    a batch the first set's."""
    ends = np.cumsum([np.ravel(length)[0] for length in lengths])
    return int(min(np.searchsorted(ends, np.ravel(position)[0]), len(ends) - 1))


def characteristic_admittance(rig: Rig) -> float:
    """A/(rho a) of the first segment, m3/(Pa s): a leak well below it cannot be seen."""
    segment = rig.line[0]
    return 0.25 * np.pi * segment.diameter**2 / (rig.fluid.density * segment.wave_speed)


def on_line(network, position):
    """`position` (m), clipped to the line, which a fit may have made a little shorter.

    `network` is a `FrequencyDomainLine` or a `TimeDomainLine`.
    """
    return np.clip(position, 0.0, network.length)


def scale_sensor(network, index: int, factor) -> None:
    """Multiply the reading of sensor `index` by `factor` (..., F), of no unit."""
    ones = np.ones((len(network.sensor_positions), *np.shape(factor)), complex)
    factors = network.sensor_factor * ones
    factors[index] *= factor
    network.sensor_factor = factors
