"""What a reader is told in place of an identifier: effects, elements and parameters in words."""

from __future__ import annotations

import re
from collections.abc import Sequence

AT_SENSOR = {
    "sensor_gain": "gain",
    "sensor_delay": "delay",
    "sensor_dynamics": "resonance",
}
AT_OTHER = {
    "unsteady_friction": "unsteady friction",
    "thermal_boundary_layer": "heat exchange with the wall",
    "entrained_air": "entrained air",
    "viscoelastic_wall": "viscoelastic wall",
    "side_branch": "side branch",
    "side_hole": "side hole",
    "leak": "leak",
    "line_volume": "volume at the line",
    "load_volume": "volume at the load",
    "load_dynamics": "dynamics of the load",
    "end_radiation": "radiation from the open end",
    "end_reflection": "reflection at the anechoic end",
    "source_impedance": "impedance of the pump",
    "piston_spread": "spread of the pistons",
    "speed_fluctuation": "fluctuation of the speed",
    "passive_network": "network without a name",
    "passive_piece": "piece of another pipe",
}
IMPLIED_PLACES = ("line", "position", "load", "source")
"""Elements that an effect's name says already, or that say no place."""

PARAMETERS = {
    "load": "resistance of the load, relative",
    "position": "distance from the pump",
    "compliance_ratio": "additional compliance of the wall",
    "retardation_time": "retardation time of the wall",
    "conductance": "leakage conductance",
    "gas_fraction": "free gas, by volume",
    "gain_error": "error of the gain",
    "viscosity": "kinematic viscosity",
    "port_timing": "port timing, late",
    "end_correction": "end correction, of the radius",
}
STATES = {
    "healthy": "healthy",
    "slipper": "worn slipper",
    "cylinder": "scratched cylinder block",
    "unlike": "unlike everything that was tried",
}
NOTHING = "nothing missing"


def name_effect(name: str, element: str | None = None) -> str:
    """An effect at its element in words: "gain of sensor p1", "viscoelastic wall of segment 2".

    `element` may end in the form of the effect in brackets: "load (spool)".
    """
    words = AT_SENSOR.get(name) or AT_OTHER.get(name) or name.replace("_", " ")
    if not element:
        return words
    place, form = re.fullmatch(r"(.*?)(?: \((.*)\))?", element).groups()
    if place not in IMPLIED_PLACES:
        words = f"{words} of {place}"
    return f"{words} ({form})" if form else words


def name_hypothesis(label: str) -> list[str]:
    """Each effect of a fit's label ("sensor_gain, sensor p1 + leak, position") in words."""
    if not label:
        return [NOTHING]
    return [name_effect(*effect.split(", ", 1)) for effect in label.split(" + ")]


def name_parameter(name: str) -> str:
    """A parameter in words: "wave_speed[2]" is "wave speed of segment 2"."""
    stem, index = re.fullmatch(r"([^\[]*)(?:\[(.*)\])?", name, re.DOTALL).groups()
    words = PARAMETERS.get(stem, stem.replace("_", " "))
    if index is None:
        return words
    if stem in ("position", "gain", "phase"):
        return f"{stem} of sensor {index}"
    if stem == "state":
        return f"wave speed during {index}, relative"
    if stem == "reflection":
        return f"Schur parameter {index} of the load"
    return f"shaft angle of {index}" if stem == "angle" else f"{words} of segment {index}"


def name_element(element: str) -> str:
    """An element of the rig in words, "the pump", "segment 2", "sensor p1"."""
    stem, _, kind = element.partition(", ")
    words = {"source": "the pump", "load": "the load", "line": "the whole line"}.get(stem, stem)
    words = words.replace("position", "one place")
    words = words.replace("between pump", "between the pump").replace("and load", "and the load")
    return f"{words} ({kind})" if kind else words


def name_place(element: str) -> str:
    """Where an element is, in words: "at the pump", "in segment 2", "between p1 and p2"."""
    words = name_element(element)
    if words.startswith("between"):
        return words
    return f"in {words}" if words.startswith(("segment", "the whole")) else f"at {words}"


def name_state(state: str) -> str:
    """A pump's state in words; two faults together are joined by "and"."""
    return " and ".join(STATES.get(part, part.replace("_", " ")) for part in state.split("+"))


def join_words(words: Sequence[str]) -> str:
    """Words as in a sentence: "a, b and c"; "" for none."""
    words = list(words)
    return ", ".join(words[:-1]) + " and " + words[-1] if len(words) > 1 else "".join(words)
