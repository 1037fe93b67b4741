"""What a line in the time domain is made of; `method_of_characteristics` sets it in motion.

`TimeDomainLine` is the counterpart of `line_network.FrequencyDomainLine`: a mutable description of
source, pipes, elements and load that the effects of `rippletwin.twin.effects` change before it is
simulated.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

ENDS = ("orifice", "open", "closed", "anechoic", "resistance")


@dataclass(frozen=True)
class Pipe:
    """Length and diameter in m, wave speed in m/s of the elastic wall.

    creep   terms (kappa, tau in s) of a retarded compliance:
            Y' = A s/(rho a^2) (1 + sum_k kappa_k/(1 + s tau_k))
    law     (P in Pa, c_1, c_2 ...) of a nonlinear compliance: the pipe also stores the share
            sum_k c_k x^k of its volume where the pressure is x P above the steady state
    """

    length: float
    diameter: float
    wave_speed: float
    creep: tuple[tuple[float, float], ...] = ()
    law: tuple[float, ...] = ()

    def yielding(self, s: np.ndarray) -> np.ndarray:
        """1 + sum_k kappa_k/(1 + s tau_k), shape of `s` (1/s)."""
        return 1.0 + sum(kappa / (1.0 + s * tau) for kappa, tau in self.creep) + 0.0 * s

    def softened(self, added: float) -> Pipe:
        """The pipe with an elastic Y' 1 + `added` times as large and the same retarded part."""
        more = 1.0 + added
        creep = tuple((kappa / more, tau) for kappa, tau in self.creep)
        return replace(self, wave_speed=self.wave_speed / np.sqrt(more), creep=creep)

    def linear(self, density: float) -> Pipe:
        """The pipe for a small ripple: with `density`, kg/m3, `law` becomes a lower wave speed."""
        if not self.law:
            return self
        added = density * self.wave_speed**2 * self.law[1] / self.law[0]
        return replace(self.softened(added), law=())


@dataclass(frozen=True)
class Element:
    """A linear one-port N(s)/D(s) at `position` (m), in SI units.

    kind "shunt": the flow q = (N/D) p leaves the line; "series": the pressure falls by (N/D) q.
    `numerator` and `denominator` are coefficients of s, highest power first, s^2 at most, and N
    at most one power higher than D. Sums are several elements at one position. They respond to the
    deviation from the steady state at the line's mean flow, in which their mean flows are already
    contained.
    """

    position: float
    kind: str
    numerator: tuple[float, ...]
    denominator: tuple[float, ...] = (1.0,)

    def immittance(self, s: np.ndarray) -> np.ndarray:
        """N(s)/D(s), shape of `s` (1/s)."""
        return np.polyval(self.numerator, s) / np.polyval(self.denominator, s)


@dataclass(frozen=True)
class Storage:
    """A nonlinear capacitance at `position` (m): it stores the volume sum_k c_k x^k, m3, where the
    pressure is x P above the steady state; `law` is (P in Pa, c_1, c_2 ...)."""

    position: float
    law: tuple[float, ...]


@dataclass(frozen=True)
class Branch:
    """A `pipe` with its far end closed, at `position` (m).

    Its friction follows the line's law, in oil `viscosity_ratio` times as viscous as the line's.
    """

    position: float
    pipe: Pipe
    viscosity_ratio: float = 1.0


@dataclass(frozen=True)
class End:
    """The load. kind and its numbers:

    "orifice"     q = K (1 + y) sqrt(p - p0): `coefficient` K, `pressure` p0 behind it, and y the
                  response of the `valve` N/D to the deviation of p from the steady state
    "open"        p = p0
    "closed"      q = 0
    "anechoic"    q = q0 + (p - p0)/Zc, Zc that of the lossless last pipe, q0 the mean flow
    "resistance"  q = q0 + G (p - p0): `coefficient` G
    """

    kind: str
    pressure: float = 0.0
    coefficient: float = 0.0
    valve: Element | None = None


@dataclass
class TimeDomainLine:
    """Source, pipes, elements and load; SI units.

    pipes      pump first
    flow       (M,) m3/s of the pump at M even steps of a `period` (s)
    end        the load
    density, kinematic viscosity, friction   as in `pipe_immittance.series_impedance`
    positions  (S,) m where pressure and flow are wanted; beside an element, on the pump's side
    mean_flow  m3/s of the steady state from which elements measure; that of `flow` by default
    source     shunt elements parallel to the pump; their position does not matter
    passage    series elements between these and x = 0; their position does not matter
    inserts    elements, storages and branches on the line, those at one position in order from the
               pump
    load       elements right before the end, in order; their position does not matter
    sensors    (index into positions, H) pairs: H(s) is what a sensor reads over the pressure,
               at s (F,) of which the first is 0
    """

    pipes: list[Pipe]
    flow: np.ndarray
    period: float
    end: End
    density: float
    viscosity: float
    friction: str = "unsteady"
    positions: Sequence[float] = ()
    mean_flow: float | None = None
    source: list[Element] = field(default_factory=list)
    passage: list[Element] = field(default_factory=list)
    inserts: list[Element | Storage | Branch] = field(default_factory=list)
    load: list[Element] = field(default_factory=list)
    sensors: list[tuple[int, Callable[[np.ndarray], np.ndarray]]] = field(default_factory=list)

    @property
    def length(self) -> float:
        """Length of the whole line, m."""
        return float(sum(pipe.length for pipe in self.pipes))


def capacitance(position: float, value: float) -> Element:
    """The shunt q = C dp/dt, `value` C in m3/Pa."""
    return Element(position, "shunt", (value, 0.0))


def inertance(position: float, value: float) -> Element:
    """The series dp = I dq/dt, `value` I in Pa s2/m3."""
    return Element(position, "series", (value, 0.0))
