"""What a reader is told in place of an identifier: effects, elements and parameters in words."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

AT_SENSOR = {
    "sensor_gain": "gain error",
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
    "gas_volume": "volume of gas at the line",
    "load_volume": "volume at the load",
    "load_dynamics": "dynamics of the load",
    "end_radiation": "radiation from the open end",
    "end_reflection": "reflection at the anechoic end",
    "source_impedance": "volume or leakage at the pump",
    "piston_spread": "spread of the pistons",
    "speed_fluctuation": "fluctuation of the speed",
    "passive_network": "network without a name",
    "passive_piece": "piece of another pipe",
}
ON_THE_WHOLE_LINE = {"viscoelastic_wall": "viscoelastic walls of all segments"}
WORDS_AFTER_FORM = {"source_impedance": "at the pump"}
"""Effects that their form names: "volume at the pump"."""
IMPLIED_PLACES = ("line", "position", "load", "source")
"""Elements that an effect's name says already, or that say no place."""
PLACES = ("between ", "in ", "at ")  # beginnings of what says a place already

PARAMETERS = {
    "load": "factor on the load's coefficient or impedance",
    "position": "distance from the pump",
    "compliance_ratio": "additional compliance of the wall",
    "retardation_time": "retardation time of the wall",
    "conductance": "leakage conductance",
    "gas_fraction": "free gas by volume",
    "gas_volume": "volume of the gas at 10 MPa",
    "gain_error": "gain error",
    "viscosity": "kinematic viscosity",
    "viscosity_slope": "relative change of the viscosity over that of the wave speeds",
    "port_timing": "lag of the port timing",
    "end_correction": "end correction in radii",
}
ELEMENTS = {
    "source": "the pump",
    "load": "the load",
    "line": "the whole line",
    "position": "one place",
}
STATES = {
    "healthy": "healthy",
    "slipper": "worn slipper",
    "cylinder": "scratched cylinder block",
    "unlike": "unlike everything that was tried",
}
NOTHING = "nothing missing"


def name_effect(name: str, element: str | None = None) -> str:
    """An effect at its element in words: "delay of sensor p1", "viscoelastic wall of segment 2".

    `element` may be a distance ("1.20 m") or a place ("in segment 2"). It may end in the form of
    the effect in brackets, and in the number of one of several at free positions: "load (spool)",
    "position (shunt) 2".
    """
    if element == "line" and name in ON_THE_WHOLE_LINE:
        return ON_THE_WHOLE_LINE[name]
    words = AT_SENSOR.get(name) or AT_OTHER.get(name) or name.replace("_", " ")
    if not element:
        return f"{words} of a sensor" if name in AT_SENSOR else words
    if re.fullmatch(r"[\d.]+ m", element):
        return f"{words} {element} from the pump"
    numbered = re.fullmatch(r"(position.*) (\d+)", element)
    if numbered:
        element = numbered.group(1)
        words += f" number {numbered.group(2)}"
    place, form = re.fullmatch(r"(.*?)(?: \((.*)\))?", element, re.DOTALL).groups()
    if form and name in WORDS_AFTER_FORM:
        return f"{form} {WORDS_AFTER_FORM[name]}"
    if place.startswith(PLACES):
        words += f" {name_place(place)}"
    elif place not in IMPLIED_PLACES:
        words += f" of {place}"
    return f"{words} ({form})" if form else words


def name_effects(effects: Iterable[tuple[str, str | None]]) -> str:
    """Effects (name, element) as in a sentence, those of one name together.

    "unsteady friction and resonance of sensors p1 and p2"; "" for none.
    """
    elements: dict[str, list[str | None]] = {}
    for name, element in effects:
        elements.setdefault(name, []).append(element)
    groups = []
    for name, each in elements.items():
        kinds = [re.fullmatch(r"(sensor|segment) (.+)", e or "", re.DOTALL) for e in each]
        if len(each) > 1 and all(kinds):
            own = join_words(sorted(kind.group(2) for kind in kinds))
            words = name_effect(name, each[0]).removesuffix(f" of {each[0]}")
            groups.append(f"{words} of {kinds[0].group(1)}s {own}")
        else:
            groups += [name_effect(name, element) for element in each]
    is_nested = len(groups) > 1 and any(" and " in group for group in groups)
    return "; ".join(groups) if is_nested else join_words(groups)


def name_equivalents(classes: Iterable[Sequence[str]]) -> str:
    """The `equivalents` of a verdict, lists of "name" or "name at place", in words."""
    return "; ".join(
        join_words([name_effect(*label.split(" at ", 1)) for label in labels]) for labels in classes
    )


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
    words = ELEMENTS.get(stem, stem)
    if words.startswith("between "):
        words = re.sub(r"\b(pump|load)$|(?<=^between )pump\b", r"the \g<0>", words)
    return f"{words} ({kind})" if kind else words


def name_place(element: str) -> str:
    """Where an element is, in words: "at the pump", "in segment 2", "between p1 and p2"."""
    words = name_element(element)
    if words.startswith(PLACES):
        return words
    return f"in {words}" if words.startswith(("segment", "the whole")) else f"at {words}"


def name_change(element: str | None, orders: Sequence[int]) -> str:
    """What else than a fault has changed, of `unlike.where` in diagnosis.json: "something else has
    changed at the pump, most at shaft orders 9, 18"."""
    places = {None: "", "source": " at the pump", "line": " in the line or at the load"}
    where = places.get(element, f" at {element}")
    most = f", most at shaft orders {', '.join(map(str, orders))}" if orders else ""
    return f"something else has changed{where}{most}"


def name_ordinal(number: int) -> str:
    """A number counted from 1 as a rank: "first", "second", "third", "4th" ..."""
    return {1: "first", 2: "second", 3: "third"}.get(number, f"{number}th")


def name_state(state: str) -> str:
    """A pump's state in words; two faults together are joined by "and"."""
    return " and ".join(STATES.get(part, part.replace("_", " ")) for part in state.split("+"))


def join_words(words: Sequence[str]) -> str:
    """Words as in a sentence: "a, b and c"; "" for none."""
    words = list(words)
    return ", ".join(words[:-1]) + " and " + words[-1] if len(words) > 1 else "".join(words)
