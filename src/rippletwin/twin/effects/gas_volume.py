"""A volume of gas on the line: an accumulator, trapped air.

Its compliance falls with the mean pressure, that of a volume of liquid does not.
"""

from __future__ import annotations

from rippletwin.twin.effects.base import Effect, position_parameter, position_place
from rippletwin.twin.effects.lumped_elements import (
    capacitance_at_position,
    gas_compliance,
    polytropic_parameter,
)
from rippletwin.twin.parameters import Parameter
from rippletwin.twin.priors import lognormal


def _compliance(state, k, values):
    pressure = state.absolute_pressure_in(k)
    return gas_compliance(values["gas_volume"], values["polytropic_exponent"], pressure)


_apply, _apply_in_time = capacitance_at_position(_compliance)

EFFECT = Effect(
    name="gas_volume",
    element="position",
    medium="liquid",
    equation="q1 - q2 = s V/(n p_m) p, V = V_10MPa (10 MPa/p_m)^(1/n), p_m absolute",
    source="p V^n = const; Wylie & Streeter 1993, Fluid Transients in Systems (air chamber)",
    parameters=lambda rig, place: (
        position_parameter(rig),
        Parameter("gas_volume", "m3", lognormal(3e-7 * (rig.line[0].diameter / 0.02) ** 3, 2.0)),
        polytropic_parameter(),
    ),
    places=position_place,
    apply=_apply,
    apply_in_time=_apply_in_time,
)
