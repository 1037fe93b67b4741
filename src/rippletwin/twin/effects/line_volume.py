"""A lumped volume on the line: a block, a filter, a short dead end."""

from __future__ import annotations

from rippletwin.line.frequency_domain.line_network import Insert
from rippletwin.line.time_domain.line_elements import capacitance
from rippletwin.twin.effects.base import (
    Effect,
    on_line,
    position_parameter,
    position_place,
    segment_at,
)
from rippletwin.twin.effects.lumped_elements import volume_compliance
from rippletwin.twin.parameters import Parameter
from rippletwin.twin.priors import lognormal


def _apply(network, state, values, place):
    k = segment_at(network.lengths, values["position"])
    compliance = volume_compliance(values["volume"], state.density, state.wave_speeds[k])
    position = on_line(network, values["position"])
    network.inserts.append(Insert(position, "shunt", network.s * compliance))


def _apply_in_time(line, state, values, place):
    k = segment_at([pipe.length for pipe in line.pipes], values["position"])
    compliance = volume_compliance(values["volume"], state.density, state.wave_speeds[k])
    line.inserts.append(capacitance(on_line(line, values["position"]), compliance))


EFFECT = Effect(
    name="line_volume",
    element="position",
    medium="any",
    equation="q1 - q2 = s V/(rho a^2) p",
    source="Wylie & Streeter 1993, sec. 12.5 (lumped capacitance)",
    parameters=lambda rig, place: (
        position_parameter(rig),
        Parameter("volume", "m3", lognormal(5e-5 * (rig.line[0].diameter / 0.02) ** 3, 1.2)),
    ),
    places=position_place,
    apply=_apply,
    apply_in_time=_apply_in_time,
    limits=(("load_volume", None), ("source_impedance", "volume")),
)
