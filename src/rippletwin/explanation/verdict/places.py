"""Elements and intervals of the line in words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rippletwin.explanation.localise.free_corrections import element_extent


def element_and_extent(rig, place, parameters: dict) -> tuple[str, list[float]]:
    """Element and interval along the line (m) at which an effect acts.

    An effect at a position acts in a segment if the whole 95 % interval is in it, otherwise between
    two sensors.
    """
    ends = np.cumsum([s.length for s in rig.line])
    starts = ends - [s.length for s in rig.line]
    if "position" in parameters:
        low, high = parameters["position"]["ci95"]
        middle = parameters["position"]["value"]
        k = int(min(np.searchsorted(ends, middle), len(ends) - 1))
        if low >= starts[k] and high <= ends[k]:
            return f"segment {k + 1}", [low, high]
        return stretch_between_sensors(rig, low, high), [low, high]
    return place.element, list(element_extent(rig, place.element))


def element_in_words(rig, element: tuple, interval) -> tuple[str, list[float]]:
    """Element and interval along the line (m) of an element as in `localise.elements`."""
    kind, where = element
    length = float(rig.length)
    if kind == "source":
        return "source", [0.0, 0.0]
    if kind == "sensor":
        sensor = rig.sensors[where]
        return f"sensor {sensor.name}", [float(sensor.position)] * 2
    if kind.startswith("segment"):
        name = f"segment {where + 1}"
        return name, list(element_extent(rig, name))
    low, high = interval
    if where == 0.0:
        return "source", [low, high]
    if where == length:
        return "load", [low, high]
    return stretch_between_sensors(rig, low, high), [low, high]


def stretch_between_sensors(rig, low: float, high: float) -> str:
    """The stretch between pump, sensors and load that contains an interval, m, in words."""
    marks = [("pump", 0.0), *((s.name, s.position) for s in rig.sensors), ("load", rig.length)]
    marks.sort(key=lambda mark: mark[1])
    left = [name for name, x in marks if x <= low] or ["pump"]
    right = [name for name, x in marks if x >= high] or ["load"]
    return f"between {left[-1]} and {right[0]}"


def extent_in_words(ends: Sequence[float]) -> str:
    """An interval of the line, m from the pump, in words."""
    low, high = (f"{end:.2f}" for end in ends)
    return f"{low} to {high} m from the pump" if low != high else f"{low} m from the pump"
