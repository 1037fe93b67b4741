"""Elements that a free, smooth correction may change: the source, sensors and parts of the line.

An element is a pair (kind, where):

    (NONE, None)                     no element
    ("source", None)                 the pump's flow
    ("sensor", index)                the reading of a sensor
    ("segment series", segments)     impedance per metre of a segment, `segments` its index, or of
                                     several, `segments` their indices
    ("segment shunt", segments)      admittance per metre, likewise
    ("shunt", position)              an element across the line at a position in m
    ("series", position)             an element in the line there
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from rippletwin.line.frequency_domain.line_network import FrequencyDomainLine, Insert

POSITIONS_PER_WAVELENGTH = 4
"""Of the highest frequency: at so many places along the line an element is tried."""

NONE = "nothing"


def elements_of(rig, observations: Sequence, own: Sequence[tuple] = ()) -> list[tuple]:
    """The elements whose correction is tried: pairs (kind, where).

    Those at positions are at both ends only. `own` are further ones. Which positions between the
    ends matter depends on the model (`SmoothCorrections.promising_positions`).
    """
    elements: list[tuple] = [(NONE, None)]
    if not all(o.kind == "input_impedance" for o in observations):
        elements += [("source", None), *(("sensor", k) for k in range(len(rig.sensors)))]
    elements += [
        (f"segment {kind}", k) for k in range(len(rig.line)) for kind in ("series", "shunt")
    ]
    elements += [(kind, float(x)) for x in (0.0, rig.length) for kind in ("shunt", "series")]
    return [*elements, *(e for e in own if e not in elements)]


def position_spacing(rig, frequency_hz: np.ndarray) -> float:
    """Distance (m) of the positions that are tried: closer ones cannot be told apart.

    `frequency_hz` (F,) are those of the observations.
    """
    wavelengths = rig.delay * float(np.max(frequency_hz))
    return float(rig.length) / (POSITIONS_PER_WAVELENGTH * wavelengths)


def own_element(effect, place, values: Mapping[str, float], rig) -> tuple:
    """The element at which an effect itself acts, with its fitted `values` by name, SI units."""
    everywhere = tuple(range(len(rig.line))) if len(rig.line) > 1 else 0
    if effect.element == "sensor":
        return "sensor", place.index
    if place.element.startswith("segment"):
        return "segment shunt", place.index
    if place.element == "line":
        return ("segment series" if effect.friction else "segment shunt"), everywhere
    position = {"source": 0.0, "load": float(rig.length)}.get(effect.element)
    if position is None:
        position = float(values["position"])
    return (place.form if place.form in ("shunt", "series") else "shunt"), position


def unit_immittance(network: FrequencyDomainLine, element: tuple) -> np.ndarray:
    """The immittance (F,) of which a correction is a multiple, of an element of the line.

    In SI units: of a segment per metre, Pa s/m4 in series or m2/(Pa s) as a shunt; elsewhere the
    characteristic impedance of the first segment, Pa s/m3, or its inverse.
    """
    kind, where = element
    if kind.startswith("segment"):
        per_metre = getattr(network, kind.split()[1])
        return per_metre[where if isinstance(where, int) else where[0]]
    characteristic = np.sqrt(network.shunt[0] / network.series[0])
    return characteristic if kind == "shunt" else 1.0 / characteristic


def correct_line(
    network: FrequencyDomainLine,
    element: tuple,
    correction: np.ndarray | float,
    reference: FrequencyDomainLine,
) -> FrequencyDomainLine:
    """A copy of `network` with a relative correction, (F,) or a number, of an element.

    What is inserted at a position is `correction` times the unit immittance of `reference`, the
    line at which corrections were linearised. The source and the sensors are left as they are.
    """
    (kind, where), changes = element, {}
    if kind in ("segment series", "segment shunt"):
        name = kind.split()[1]
        per_metre = getattr(network, name).copy()
        rows = [where] if isinstance(where, int) else list(where)
        per_metre[rows] = per_metre[rows] * (1.0 + correction)
        changes[name] = per_metre
    elif kind in ("shunt", "series"):
        at = float(np.clip(where, 0.0, network.length))
        added = Insert(at, kind, correction * unit_immittance(reference, element))
        changes["inserts"] = [*network.inserts, added]
    return replace(network, **changes)
