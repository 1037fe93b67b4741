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


def _compliance(lengths, state, values):
    k = segment_at(lengths, values["position"])
    return volume_compliance(values["volume"], state.density, state.wave_speeds[k])


def _apply(network, state, values, place):
    admittance = network.s * _compliance(network.lengths, state, values)
    network.inserts.append(Insert(on_line(network, values["position"]), "shunt", admittance))


def _apply_in_time(line, state, values, place):
    compliance = float(_compliance([pipe.length for pipe in line.pipes], state, values))
    line.inserts.append(capacitance(on_line(line, values["position"]), compliance))


EFFECT = Effect(
    name="line_volume",
    element="position",
    medium="any",
    equation="q1 - q2 = s V/(rho a^2) p",
    source="Wylie & Streeter 1993, sec. 12.5 (lumped capacitance)",
    parameters=lambda rig, place: (
        position_parameter(rig),
        # From the bore of a sensor's adapter, a tenth of a cm3, to a filter's housing. Fits start
        # at ten times the median: a small volume is found beside other effects.
        Parameter(
            "volume", "m3", lognormal(5e-6 * (rig.line[0].diameter / 0.02) ** 3, 2.0), (1.15,)
        ),
    ),
    places=position_place,
    apply=_apply,
    apply_in_time=_apply_in_time,
    limits=(("load_volume", None), ("source_impedance", "volume")),
)
