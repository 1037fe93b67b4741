"""Effects at random places and of random strength, for rigs whose effect is concealed.

One short function an effect: it draws the arguments of `virtualrig.effects` and says in the words
of a verdict what the truth then is. Strengths are log-uniform between two ends,
the weaker below what any method could see, the stronger plain to the eye.
"""

from collections.abc import Callable
from dataclasses import asdict, dataclass, field

import numpy as np

AT_LEAST = 0.2
"""Metres that a place keeps from joints, ends and other places: short pipes cost small steps."""

PASSIVE = 0.9  # of the gain at which a valve begins to feed the line at some frequency


@dataclass(frozen=True)
class Concealed:
    """An effect as drawn.

    `arguments` are those of the rig's effect; `element` and `parameters` (name -> true value) are
    in a verdict's words; `position` in m from the pump outlet where the effect sits at one;
    `level` is where its strength lies between the weak and the strong end, 0 to 1, on a logarithmic
    scale; None where it has no strength.
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
class Bare:
    """What drawing an effect needs to know of the rig it goes into.

    `segments` are the true ones; `modulus` is that by which the rig turns a volume into a
    compliance, Pa; `flow` (m3/s) and `pressure` (Pa) are means over the operating points; `taken`
    are the places in use.
    """

    rng: np.random.Generator
    segments: list[dict]
    sensors: int
    density: float
    modulus: float
    flow: float
    pressure: float
    taken: list[float] = field(default_factory=list)

    def between(self, weak: float, strong: float, level: float) -> float:
        return weak * (strong / weak) ** level

    def uniform(self, low: float, high: float) -> float:
        return float(self.rng.uniform(low, high))

    def log_uniform(self, low: float, high: float) -> float:
        return float(low * (high / low) ** self.rng.uniform())

    @property
    def length(self) -> float:
        return sum(segment["length"] for segment in self.segments)

    def place(self) -> float:
        """A position on the line, away from what is there."""
        ends = np.concatenate([[0.0], np.cumsum([s["length"] for s in self.segments])])
        for _ in range(1000):
            position = self.uniform(0.0, self.length)
            if np.abs(np.array([*ends, *self.taken]) - position).min() > AT_LEAST:
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

    def bore(self, k: int) -> float:
        """Cube of segment k's diameter over 20 mm: what volumes scale with."""
        return (self.segments[k]["diameter"] / 0.02) ** 3


def unsteady_friction(bare: Bare, level: float) -> Concealed:
    return Concealed("unsteady_friction", "line", {}, None)


def viscoelastic_wall(bare: Bare, level: float) -> Concealed:
    longest = np.array([s["length"] for s in bare.segments])
    k = int(bare.rng.choice(len(longest), p=longest / longest.sum()))
    compliance = bare.between(0.01, 0.3, level)
    time = bare.log_uniform(1e-4, 1e-3)
    return Concealed(
        "viscoelastic_wall",
        f"segment {k + 1}",
        {"segment": k + 1, "compliance": compliance, "time": time},
        level,
        parameters={"compliance_ratio": compliance, "retardation_time": time},
    )


def entrained_air(bare: Bare, level: float) -> Concealed:
    fraction, exponent = bare.between(3e-4, 3e-2, level), bare.uniform(1.05, 1.35)
    return Concealed(
        "entrained_air",
        "line",
        {"fraction": fraction, "exponent": exponent},
        level,
        parameters={"gas_fraction": fraction, "polytropic_exponent": exponent},
    )


def side_branch(bare: Bare, level: float) -> Concealed:
    position = bare.place()
    segment = bare.segments[bare.segment_at(position)]
    diameter = segment["diameter"] * bare.between(0.1, 0.9, level)
    length = bare.log_uniform(0.2, 1.2)
    arguments = {
        "position": position,
        "length": length,
        "diameter": diameter,
        "wave_speed": segment["wave_speed"],
    }
    parameters = {"position": position, "length": length, "diameter": diameter}
    return Concealed("side_branch", "position", arguments, level, position, parameters)


def leak(bare: Bare, level: float) -> Concealed:
    """As a share of the pump's flow; through a gap (laminar) or a hole (square law)."""
    position, lost = bare.place(), bare.flow * bare.between(0.003, 0.2, level)
    if bare.rng.uniform() < 0.5:
        arguments = {"position": position, "conductance": lost / bare.pressure}
        at_reference = lost / bare.pressure
    else:
        arguments = {"position": position, "orifice": lost / np.sqrt(bare.pressure)}
        at_reference = 0.5 * arguments["orifice"] / np.sqrt(1e7)
    parameters = {"position": position, "conductance": float(at_reference)}
    return Concealed("leak", "position", _plain(arguments), level, position, parameters)


def line_volume(bare: Bare, level: float) -> Concealed:
    position = bare.place()
    k = bare.segment_at(position)
    volume = bare.between(2e-6, 2e-4, level) * bare.bore(k)
    held = {"position": position, "volume": volume * bare.stiffness(k) / bare.modulus}
    arguments = {"position": position, "volume": volume}
    return Concealed("line_volume", "position", arguments, level, position, held)


def load_volume(bare: Bare, level: float) -> Concealed:
    volume = bare.between(2e-6, 2e-4, level) * bare.bore(-1)
    held = volume * bare.stiffness(-1) / bare.modulus
    return Concealed("load_volume", "load", {"volume": volume}, level, None, {"volume": held})


def source_impedance(bare: Bare, level: float) -> Concealed:
    volume = bare.between(2e-6, 2e-4, level) * bare.bore(0)
    held = volume * bare.stiffness(0) / bare.modulus
    return Concealed(
        "source_impedance", "source", {"volume": volume}, level, None, {"volume": held}
    )


def load_dynamics(bare: Bare, level: float) -> Concealed:
    gain = bare.between(0.03, 2.0, level)
    frequency, damping = bare.log_uniform(100.0, 1200.0), bare.log_uniform(0.2, 0.8)
    # A valve that feeds the line may chatter, and nothing is periodic then. The real part of its
    # 1/2 + gain H is least above resonance, by gain/(4 damping (1 + damping)).
    gain = min(gain, PASSIVE * 2 * damping * (1 + damping))
    return Concealed(
        "load_dynamics",
        "load",
        {"gain": gain, "frequency_hz": frequency, "damping": damping},
        level,
        # relative to the slope of the fixed orifice, which is half of flow over pressure
        parameters={"gain": 2 * gain, "natural_frequency": frequency, "damping_ratio": damping},
    )


def piston_spread(bare: Bare, level: float) -> Concealed:
    bore = bare.between(1e-4, 1e-2, level)
    arguments = {"bore_area": bore, "case_leakage": 20 * bore, "angle_deg": 20 * bore}
    arguments["seed"] = int(bare.rng.integers(2**31))
    return Concealed("piston_spread", "source", arguments, level)


def speed_fluctuation(bare: Bare, level: float) -> Concealed:
    """Once a revolution, the twin's form of it."""
    amplitude = bare.between(1e-4, 1e-2, level)
    arguments = {"order": 1, "amplitude": amplitude, "phase": bare.uniform(0, 2 * np.pi)}
    return Concealed("speed_fluctuation", "source", arguments, level)


def sensor_dynamics(bare: Bare, level: float) -> Concealed:
    frequency, damping = bare.between(30000.0, 1500.0, level), bare.log_uniform(0.05, 0.5)
    return _at_sensor(
        bare,
        "sensor_dynamics",
        level,
        {"frequency_hz": frequency, "damping": damping},
        {"natural_frequency": frequency, "damping_ratio": damping},
    )


def sensor_gain(bare: Bare, level: float) -> Concealed:
    error = bare.between(0.002, 0.2, level) * bare.rng.choice([-1.0, 1.0])
    return _at_sensor(
        bare, "sensor_gain", level, {"gain": float(1 + error)}, {"gain_error": float(error)}
    )


def sensor_delay(bare: Bare, level: float) -> Concealed:
    delay = bare.between(1e-6, 3e-4, level)
    return _at_sensor(bare, "sensor_delay", level, {"delay": delay}, {"delay": delay})


def accumulator(bare: Bare, level: float) -> Concealed:
    position = bare.place()
    arguments = {
        "position": position,
        "gas_volume": bare.between(2e-8, 5e-6, level) * bare.bore(bare.segment_at(position)),
        "gas_pressure": bare.pressure,
    }
    return Concealed("accumulator", "position", arguments, level, position)


def stiffening_liquid(bare: Bare, level: float) -> Concealed:
    """About the mean pressure, so that calibration takes up what is the same at every point."""
    arguments = {"per_pascal": bare.between(1e-9, 5e-8, level), "reference": bare.pressure}
    return Concealed("stiffening_liquid", "line", arguments, level)


def turbulent_friction(bare: Bare, level: float) -> Concealed:
    return Concealed(
        "turbulent_friction", "line", {"factor": bare.between(0.01, 1.0, level)}, level
    )


def moving_bend(bare: Bare, level: float) -> Concealed:
    return _side_arm(bare, "moving_bend", level, 40.0, 300.0)


def resonator(bare: Bare, level: float) -> Concealed:
    return _side_arm(bare, "resonator", level, 200.0, 2000.0)


def _side_arm(bare: Bare, name: str, level: float, low: float, high: float) -> Concealed:
    position = bare.place()
    volume = bare.between(1e-6, 1e-4, level) * bare.bore(bare.segment_at(position))
    arguments = {
        "position": position,
        "frequency_hz": bare.log_uniform(low, high),
        "damping": bare.log_uniform(0.02, 0.3),
        "compliance": volume / bare.modulus,
    }
    return Concealed(name, "position", arguments, level, position)


def _at_sensor(bare: Bare, name: str, level: float, arguments: dict, truth: dict) -> Concealed:
    k = int(bare.rng.integers(bare.sensors)) + 1
    return Concealed(name, f"sensor p{k}", {"sensor": k, **arguments}, level, None, truth)


def _plain(arguments: dict) -> dict:
    return {key: float(value) for key, value in arguments.items()}


def _named(*functions: Callable[[Bare, float], Concealed]) -> dict:
    return {function.__name__: function for function in functions}


LIBRARY = _named(
    unsteady_friction, viscoelastic_wall, entrained_air, side_branch, leak, line_volume,
    load_volume, load_dynamics, source_impedance, piston_spread, speed_fluctuation,
    sensor_dynamics, sensor_gain, sensor_delay,
)  # fmt: skip
OUTSIDE = _named(accumulator, stiffening_liquid, turbulent_friction, moving_bend, resonator)


def at_pump(bare: Bare, level: float) -> tuple[Concealed, list[str]]:
    """A volume right at the pump: its outlet's or the line's, the equations are the same."""
    return source_impedance(bare, level), ["line_volume", "source_impedance"]


def at_load(bare: Bare, level: float) -> tuple[Concealed, list[str]]:
    """A volume right at the load."""
    return load_volume(bare, level), ["line_volume", "load_volume"]


def of_two_gains(bare: Bare, level: float) -> tuple[Concealed, list[str]]:
    """One sensor's gain; where the source is uncertain only the ratio of the gains is seen."""
    return sensor_gain(bare, level), ["sensor_gain"]


INDISTINGUISHABLE = (at_pump, at_load, of_two_gains)
"""Declared before any recording: each draws an effect and names the class that it belongs to."""
