"""Random effects for concealed cases: which arguments they have and what the truth then is.

Each function draws one effect at a random place. `level`, from 0 to 1, is its strength on a
logarithmic scale: at 0 no method can see the effect, at 1 it is plain to the eye.
"""

from collections.abc import Callable

import numpy as np

from virtualrig.drawn_effect import DrawnEffect, RigContext, log_between
from virtualrig.node_elements import ATMOSPHERE

STATED_PRESSURE = 1e7  # Pa absolute, at which the truth states a volume of gas
PASSIVE_SHARE = 0.9  # of the gain at which a valve begins to feed the line at some frequency


def unsteady_friction(rig: RigContext, level: float) -> DrawnEffect:
    """Friction of the unsteady velocity profile; without a strength."""
    return DrawnEffect("unsteady_friction", "line", {}, None)


def viscoelastic_wall(rig: RigContext, level: float) -> DrawnEffect:
    """In one segment, drawn in proportion to its length; 1 to 30 % of the compliance."""
    lengths = np.array([s["length"] for s in rig.segments])
    k = int(rig.rng.choice(len(lengths), p=lengths / lengths.sum()))
    compliance = log_between(0.01, 0.3, level)
    time = rig.log_uniform(1e-4, 1e-3)
    return DrawnEffect(
        "viscoelastic_wall",
        f"segment {k + 1}",
        {"segment": k + 1, "compliance": compliance, "time": time},
        level,
        parameters={"compliance_ratio": compliance, "retardation_time": time},
    )


def entrained_air(rig: RigContext, level: float) -> DrawnEffect:
    """All along the line; 0.03 to 3 % of the volume at atmospheric pressure."""
    fraction, exponent = log_between(3e-4, 3e-2, level), rig.uniform(1.05, 1.35)
    return DrawnEffect(
        "entrained_air",
        "line",
        {"fraction": fraction, "exponent": exponent},
        level,
        parameters={"gas_fraction": fraction, "polytropic_exponent": exponent},
    )


def side_branch(rig: RigContext, level: float) -> DrawnEffect:
    """A closed pipe of 10 to 90 % of the diameter and 0.2 to 1.2 m."""
    position = rig.draw_position()
    segment = rig.segments[rig.segment_at(position)]
    diameter = segment["diameter"] * log_between(0.1, 0.9, level)
    length = rig.log_uniform(0.2, 1.2)
    arguments = {
        "position": position,
        "length": length,
        "diameter": diameter,
        "wave_speed": segment["wave_speed"],
    }
    parameters = {"position": position, "length": length, "diameter": diameter}
    return DrawnEffect("side_branch", "position", arguments, level, position, parameters)


def leak(rig: RigContext, level: float) -> DrawnEffect:
    """0.3 to 20 % of the pump's flow, through a gap (laminar) or a hole (square law)."""
    position, lost = rig.draw_position(), rig.flow * log_between(0.003, 0.2, level)
    if rig.rng.uniform() < 0.5:
        arguments = {"position": position, "conductance": lost / rig.pressure}
        at_reference = lost / rig.pressure
    else:
        arguments = {"position": position, "orifice": lost / np.sqrt(rig.pressure)}
        at_reference = 0.5 * arguments["orifice"] / np.sqrt(1e7)
    parameters = {"position": position, "conductance": float(at_reference)}
    return DrawnEffect("leak", "position", _plain(arguments), level, position, parameters)


def line_volume(rig: RigContext, level: float) -> DrawnEffect:
    """2 to 200 cm3, scaled by the bore; true is what it holds in the line's liquid and wall."""
    position = rig.draw_position()
    k = rig.segment_at(position)
    volume = log_between(2e-6, 2e-4, level) * rig.volume_scale(k)
    parameters = {"position": position, "volume": volume * rig.stiffness(k) / rig.modulus}
    arguments = {"position": position, "volume": volume}
    return DrawnEffect("line_volume", "position", arguments, level, position, parameters)


def load_volume(rig: RigContext, level: float) -> DrawnEffect:
    """2 to 200 cm3, scaled by the bore, at the load."""
    volume = log_between(2e-6, 2e-4, level) * rig.volume_scale(-1)
    parameters = {"volume": volume * rig.stiffness(-1) / rig.modulus}
    return DrawnEffect("load_volume", "load", {"volume": volume}, level, None, parameters)


def source_impedance(rig: RigContext, level: float) -> DrawnEffect:
    """2 to 200 cm3, scaled by the bore, at the pump."""
    volume = log_between(2e-6, 2e-4, level) * rig.volume_scale(0)
    parameters = {"volume": volume * rig.stiffness(0) / rig.modulus}
    return DrawnEffect("source_impedance", "source", {"volume": volume}, level, None, parameters)


def load_dynamics(rig: RigContext, level: float) -> DrawnEffect:
    """A valve of second order that opens with the pressure."""
    gain = log_between(0.03, 2.0, level)
    frequency, damping = rig.log_uniform(100.0, 1200.0), rig.log_uniform(0.2, 0.8)
    # A valve that feeds the line may chatter, and nothing is periodic then. The real part of its
    # 1/2 + gain H is least above resonance, by gain/(4 damping (1 + damping)).
    gain = min(gain, PASSIVE_SHARE * 2 * damping * (1 + damping))
    return DrawnEffect(
        "load_dynamics",
        "load",
        {"gain": gain, "frequency_hz": frequency, "damping": damping},
        level,
        # relative to the slope of the fixed orifice, which is half of flow over pressure
        parameters={"gain": 2 * gain, "natural_frequency": frequency, "damping_ratio": damping},
    )


def piston_spread(rig: RigContext, level: float) -> DrawnEffect:
    """Bore areas, leakages and angles that differ from piston to piston."""
    bore = log_between(1e-4, 1e-2, level)
    arguments = {"bore_area": bore, "case_leakage": 20 * bore, "angle_deg": 20 * bore}
    arguments["seed"] = int(rig.rng.integers(2**31))
    return DrawnEffect("piston_spread", "source", arguments, level)


def speed_fluctuation(rig: RigContext, level: float) -> DrawnEffect:
    """Once a revolution: the form that the twin has."""
    amplitude = log_between(1e-4, 1e-2, level)
    arguments = {"order": 1, "amplitude": amplitude, "phase": rig.uniform(0, 2 * np.pi)}
    return DrawnEffect("speed_fluctuation", "source", arguments, level)


def sensor_dynamics(rig: RigContext, level: float) -> DrawnEffect:
    """A resonance at 30 to 1.5 kHz of one sensor."""
    frequency, damping = log_between(30000.0, 1500.0, level), rig.log_uniform(0.05, 0.5)
    return _at_sensor(
        rig,
        "sensor_dynamics",
        level,
        {"frequency_hz": frequency, "damping": damping},
        {"natural_frequency": frequency, "damping_ratio": damping},
    )


def sensor_gain(rig: RigContext, level: float) -> DrawnEffect:
    """One sensor's gain is wrong by 0.2 to 20 %."""
    error = log_between(0.002, 0.2, level) * rig.rng.choice([-1.0, 1.0])
    return _at_sensor(
        rig, "sensor_gain", level, {"gain": float(1 + error)}, {"gain_error": float(error)}
    )


def sensor_delay(rig: RigContext, level: float) -> DrawnEffect:
    """One sensor is late by 1 to 300 us."""
    delay = log_between(1e-6, 3e-4, level)
    return _at_sensor(rig, "sensor_delay", level, {"delay": delay}, {"delay": delay})


def gas_volume(rig: RigContext, level: float) -> DrawnEffect:
    """Gas of 0.02 to 5 cm3, scaled by the bore, at the mean pressure."""
    position, pressure = rig.draw_position(), rig.pressure + ATMOSPHERE
    volume = log_between(2e-8, 5e-6, level) * rig.volume_scale(rig.segment_at(position))
    exponent = rig.uniform(1.05, 1.35)
    return DrawnEffect(
        "gas_volume",
        "position",
        {
            "position": position,
            "gas_volume": volume,
            "gas_pressure": pressure,
            "exponent": exponent,
        },
        level,
        position,
        {
            "position": position,
            "gas_volume": volume * (pressure / STATED_PRESSURE) ** (1 / exponent),
            "polytropic_exponent": exponent,
        },
    )


def stiffening_liquid(rig: RigContext, level: float) -> DrawnEffect:
    """About the mean pressure: calibration can absorb what all operating points have in common."""
    arguments = {"per_pascal": log_between(1e-9, 5e-8, level), "reference": rig.pressure}
    return DrawnEffect("stiffening_liquid", "line", arguments, level)


def turbulent_friction(rig: RigContext, level: float) -> DrawnEffect:
    """Darcy factor of 0.01 to 1."""
    return DrawnEffect(
        "turbulent_friction", "line", {"factor": log_between(0.01, 1.0, level)}, level
    )


def soft_piece(rig: RigContext, level: float) -> DrawnEffect:
    """A stretch of 0.15 to 0.3 m whose wave speed is 2 to 60 % lower."""
    position = rig.draw_position()
    arguments = {
        "position": position,
        "length": rig.log_uniform(0.15, 0.3),
        "speed_ratio": 1.0 - log_between(0.02, 0.6, level),
    }
    return DrawnEffect("soft_piece", "position", arguments, level, position)


def moving_bend(rig: RigContext, level: float) -> DrawnEffect:
    """A side arm that resonates at 40 to 300 Hz."""
    return _side_arm(rig, "moving_bend", level, 40.0, 300.0)


def resonator(rig: RigContext, level: float) -> DrawnEffect:
    """A side arm that resonates at 200 to 2000 Hz."""
    return _side_arm(rig, "resonator", level, 200.0, 2000.0)


def _side_arm(rig: RigContext, name: str, level: float, low: float, high: float) -> DrawnEffect:
    position = rig.draw_position()
    volume = log_between(1e-6, 1e-4, level) * rig.volume_scale(rig.segment_at(position))
    arguments = {
        "position": position,
        "frequency_hz": rig.log_uniform(low, high),
        "damping": rig.log_uniform(0.02, 0.3),
        "compliance": volume / rig.modulus,
    }
    return DrawnEffect(name, "position", arguments, level, position)


def _at_sensor(
    rig: RigContext, name: str, level: float, arguments: dict, truth: dict
) -> DrawnEffect:
    k = int(rig.rng.integers(rig.sensors)) + 1
    return DrawnEffect(name, f"sensor p{k}", {"sensor": k, **arguments}, level, None, truth)


def _plain(arguments: dict) -> dict:
    return {key: float(value) for key, value in arguments.items()}


def _named(*functions: Callable[[RigContext, float], DrawnEffect]) -> dict:
    return {function.__name__: function for function in functions}


LIBRARY = _named(
    unsteady_friction, viscoelastic_wall, entrained_air, side_branch, leak, line_volume,
    load_volume, load_dynamics, source_impedance, piston_spread, speed_fluctuation,
    sensor_dynamics, sensor_gain, sensor_delay, gas_volume,
)  # fmt: skip
OUTSIDE = _named(stiffening_liquid, turbulent_friction, soft_piece, moving_bend, resonator)


def at_pump(rig: RigContext, level: float) -> tuple[DrawnEffect, list[str]]:
    """A volume at the pump: the equations do not tell the outlet's from the line's."""
    return source_impedance(rig, level), ["line_volume", "source_impedance"]


def at_load(rig: RigContext, level: float) -> tuple[DrawnEffect, list[str]]:
    """A volume at the load: the equations do not tell the load's from the line's."""
    return load_volume(rig, level), ["line_volume", "load_volume"]


def of_two_gains(rig: RigContext, level: float) -> tuple[DrawnEffect, list[str]]:
    """One sensor's gain: with an uncertain source only the ratio of the gains can be seen."""
    return sensor_gain(rig, level), ["sensor_gain"]


INDISTINGUISHABLE = (at_pump, at_load, of_two_gains)
"""Declared before any recording: each draws an effect and states the class that it belongs to."""
