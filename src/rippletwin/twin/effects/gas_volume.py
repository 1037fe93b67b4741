"""A volume of gas on the line: an accumulator, trapped air.

Its compliance falls with the mean pressure, that of a volume of liquid does not.
"""

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
from rippletwin.twin.effects.lumped_elements import POLYTROPIC_EXPONENT, gas_compliance
from rippletwin.twin.parameters import Parameter
from rippletwin.twin.priors import lognormal, normal


def _compliance(state, k, values):
    pressure = state.absolute_pressure_in(k)
    return gas_compliance(values["gas_volume"], values["polytropic_exponent"], pressure)


def _apply(network, state, values, place):
    k = segment_at(network.lengths, values["position"])
    position = on_line(network, values["position"])
    admittance = network.s * _compliance(state, k, values)
    network.inserts.append(Insert(position, "shunt", admittance))


def _apply_in_time(line, state, values, place):
    k = segment_at([pipe.length for pipe in line.pipes], values["position"])
    compliance = float(_compliance(state, k, values))
    line.inserts.append(capacitance(on_line(line, values["position"]), compliance))


EFFECT = Effect(
    name="gas_volume",
    element="position",
    medium="liquid",
    equation="q1 - q2 = s V/(n p_m) p, V = V_10MPa (10 MPa/p_m)^(1/n), p_m absolute",
    source="p V^n = const; Wylie & Streeter 1993, Fluid Transients in Systems (air chamber)",
    parameters=lambda rig, place: (
        position_parameter(rig),
        Parameter("gas_volume", "m3", lognormal(3e-7 * (rig.line[0].diameter / 0.02) ** 3, 2.0)),
        Parameter("polytropic_exponent", "1", normal(POLYTROPIC_EXPONENT, 0.12)),
    ),
    places=position_place,
    apply=_apply,
    apply_in_time=_apply_in_time,
)
