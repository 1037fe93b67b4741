"""Effects of the virtual rig. Each function changes the draft of a rig."""

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from virtualrig.pump import Pump

AT_LOAD = 1e-6  # m; nearer to the load is at the load
SHORTEST_PIPE = 0.05  # m; shorter ones need small time steps


@dataclass
class Draft:
    """A rig before it is built. Positions are in metres from the pump outlet.

    `segments` are keyword arguments of Pipe; `fittings` (position, keyword arguments of Node);
    `branches` (position, keyword arguments of Pipe), dead ends; `sensing` one dict a sensor, of
    Sensing's keywords; `ripple` rows (order, relative amplitude of crank speed, phase).
    """

    pump: Pump
    segments: list[dict]
    sensing: list[dict]
    friction: str = "steady"
    fittings: list[tuple[float, dict]] = field(default_factory=list)
    branches: list[tuple[float, dict]] = field(default_factory=list)
    ripple: list[tuple[float, float, float]] = field(default_factory=list)

    @property
    def length(self) -> float:
        return sum(segment["length"] for segment in self.segments)

    def fit(self, position: float, **node: float) -> None:
        """Add elements at `position`; raises ValueError outside the line."""
        if not 0 <= position <= self.length:
            raise ValueError(
                f"position {position} m is outside the line (0 to {self.length:.3f} m)"
            )
        self.fittings.append((position, node))


def _from_one(what: str, number: int) -> int:
    """The index of a segment or sensor counted from 1; raises ValueError for less."""
    if number < 1:
        raise ValueError(f"{what} {number}: {what}s count from 1")
    return number - 1


def unsteady_friction(draft: Draft) -> None:
    """Friction of the unsteady laminar velocity profile."""
    draft.friction = "unsteady"


def viscoelastic_wall(draft: Draft, segment: int, compliance: float, time: float) -> None:
    """Kelvin-Voigt wall of segment `segment` (1 is the pump's); relative compliance, time in s."""
    draft.segments[_from_one("segment", segment)]["wall"] = (compliance, time)


def entrained_air(draft: Draft, fraction: float, exponent: float = 1.2) -> None:
    """Volume fraction of free air at one atmosphere, polytropic, all along the line."""
    for segment in draft.segments:
        segment["air"] = (fraction, exponent)


def side_branch(
    draft: Draft, position: float, length: float, diameter: float, wave_speed: float
) -> None:
    """A closed pipe branching off."""
    draft.fit(position)
    branch = {"length": length, "diameter": diameter, "wave_speed": wave_speed}
    draft.branches.append((position, branch))


def leak(draft: Draft, position: float, conductance: float = 0.0, orifice: float = 0.0) -> None:
    """Laminar (m3/s/Pa) or square-law (m3/s/Pa^0.5) leak to the tank. Raises ValueError at the
    load, whose orifice is set by the operator."""
    if abs(position - draft.length) < AT_LOAD:
        raise ValueError("a leak cannot be at the load; move it towards the pump")
    draft.fit(position, leak=conductance, orifice=orifice)


def line_volume(draft: Draft, position: float, volume: float) -> None:
    """A volume of liquid, m3, on the line."""
    draft.fit(position, volume=volume / draft.pump.bulk_modulus)


def load_volume(draft: Draft, volume: float) -> None:
    """A volume of liquid, m3, just before the orifice."""
    line_volume(draft, draft.length, volume)


def load_dynamics(
    draft: Draft,
    gain: float,
    lag: float = 0.0,
    frequency_hz: float | None = None,
    damping: float = 0.0,
) -> None:
    """The valve opens with pressure: opening 1 + y, y''/w^2 + (2 damping/w + lag) y' + y = gain
    dp/p.
    """
    inertia = 0.0
    if frequency_hz is not None:
        omega = 2 * np.pi * frequency_hz
        inertia, lag = omega**-2, lag + 2 * damping / omega
    draft.fit(draft.length, valve_gain=gain, valve_lag=lag, valve_inertia=inertia)


def source_impedance(draft: Draft, volume: float) -> None:
    """A volume at the pump's outlet, m3, between its ports and the line."""
    line_volume(draft, 0.0, volume)


def piston_spread(
    draft: Draft, bore_area: float, case_leakage: float, angle_deg: float, seed: int = 0
) -> None:
    """Standard deviations from piston to piston: relative, relative, degrees of crank angle."""
    drawn = np.random.default_rng(seed).standard_normal((draft.pump.pistons, 3))
    drawn -= drawn.mean(axis=0)
    draft.pump = draft.pump.with_spread(drawn * [bore_area, case_leakage, angle_deg])


def speed_fluctuation(draft: Draft, order: int, amplitude: float, phase: float = 0.0) -> None:
    """The crank's speed varies by `amplitude` (relative) `order` times a revolution."""
    draft.ripple.append((float(order), amplitude, phase))


def sensor_dynamics(draft: Draft, sensor: int, frequency_hz: float, damping: float) -> None:
    """Sensor `sensor` (1 is nearest the pump) resonates: a cavity or its diaphragm."""
    draft.sensing[_from_one("sensor", sensor)]["resonance"] = (frequency_hz, damping)


def sensor_gain(draft: Draft, sensor: int, gain: float) -> None:
    """Readings of sensor `sensor` are `gain` times the pressure."""
    draft.sensing[_from_one("sensor", sensor)]["gain"] = gain


def sensor_delay(draft: Draft, sensor: int, delay: float) -> None:
    """Readings of sensor `sensor` are late by `delay` s."""
    draft.sensing[_from_one("sensor", sensor)]["delay"] = delay


def gas_volume(
    draft: Draft, position: float, gas_volume: float, gas_pressure: float, exponent: float = 1.4
) -> None:
    """Gas of volume `gas_volume`, m3, at the absolute pressure `gas_pressure`, Pa; nonlinear."""
    draft.fit(position, gas_volume=gas_volume, gas_pressure=gas_pressure, gas_exponent=exponent)


def stiffening_liquid(draft: Draft, per_pascal: float, reference: float) -> None:
    """rho a^2 grows with pressure, by `per_pascal` of itself a Pa above `reference` Pa."""
    for segment in draft.segments:
        segment.update(stiffening=per_pascal, reference=reference)


def turbulent_friction(draft: Draft, factor: float) -> None:
    """Darcy friction factor of rough turbulent flow, in addition to the laminar friction."""
    for segment in draft.segments:
        area = np.pi / 4 * segment["diameter"] ** 2
        segment["drag"] = factor / (2 * segment["diameter"] * area)


def soft_piece(draft: Draft, position: float, length: float, speed_ratio: float) -> None:
    """A stretch of `length` m about `position` with `speed_ratio` times the wave speed: a hose, a
    compensator.

    An end that is closer than SHORTEST_PIPE to a joint is moved there. Raises ValueError where the
    stretch is not longer than that on either side, or not on the line.
    """
    joints = np.cumsum([0.0, *(segment["length"] for segment in draft.segments)])
    wanted = np.array([position - 0.5 * length, position + 0.5 * length])
    if length <= 2 * SHORTEST_PIPE or wanted[0] < 0.0 or wanted[1] > draft.length:
        raise ValueError(
            f"a piece of {length} m at {position} m: give one longer than {2 * SHORTEST_PIPE} m "
            f"within the line (0 to {draft.length:.3f} m)"
        )
    nearest = joints[np.argmin(np.abs(joints[:, None] - wanted), axis=0)]
    ends = np.where(np.abs(nearest - wanted) < SHORTEST_PIPE, nearest, wanted)
    pieces = []
    for segment, (begin, stop) in zip(draft.segments, pairwise(joints), strict=True):
        for a, b in pairwise([begin, *(x for x in ends if begin < x < stop), stop]):
            ratio = speed_ratio if ends[0] < 0.5 * (a + b) < ends[1] else 1.0
            speed = ratio * segment["wave_speed"]
            pieces.append(segment | {"length": float(b - a), "wave_speed": speed})
    draft.segments = pieces


def moving_bend(
    draft: Draft, position: float, frequency_hz: float, damping: float, compliance: float
) -> None:
    """A bend on a spring: pressure moves it, and its motion adds volume, slowly `compliance`
    m3/Pa.
    """
    resonator(draft, position, frequency_hz, damping, compliance)


def resonator(
    draft: Draft, position: float, frequency_hz: float, damping: float, compliance: float
) -> None:
    """A lumped side arm: inertance, resistance and compliance (m3/Pa) in series (Helmholtz)."""
    omega = 2 * np.pi * frequency_hz
    inertance = 1 / (compliance * omega**2)
    draft.fit(
        position,
        arm_inertance=inertance,
        arm_resistance=2 * damping * omega * inertance,
        arm_stiffness=1 / compliance,
    )


EFFECTS: dict[str, Callable[..., None]] = {
    effect.__name__: effect
    for effect in (
        unsteady_friction, viscoelastic_wall, entrained_air, side_branch, leak, line_volume,
        load_volume, load_dynamics, source_impedance, piston_spread, speed_fluctuation,
        sensor_dynamics, sensor_gain, sensor_delay, gas_volume, stiffening_liquid,
        turbulent_friction, soft_piece, moving_bend, resonator,
    )
}  # fmt: skip
