"""A volume just before the load: the valve block, a reservoir."""

from __future__ import annotations

from rippletwin.line.frequency_domain.line_network import Insert
from rippletwin.line.time_domain.line_elements import capacitance
from rippletwin.twin.effects.base import Effect, load_place
from rippletwin.twin.effects.lumped_elements import volume_compliance
from rippletwin.twin.parameters import Parameter
from rippletwin.twin.priors import lognormal


def _apply(network, state, values, place):
    compliance = volume_compliance(values["volume"], state.density, state.wave_speeds[-1])
    network.inserts.append(Insert(network.length, "shunt", network.s * compliance))


def _apply_in_time(line, state, values, place):
    compliance = volume_compliance(values["volume"], state.density, state.wave_speeds[-1])
    line.inserts.append(capacitance(line.length, compliance))


EFFECT = Effect(
    name="load_volume",
    element="load",
    medium="any",
    equation="Y_load + s V/(rho a^2)",
    source="Johnston & Edge 1991, Proc. IMechE 205(I):89 (load with an entry volume)",
    parameters=lambda rig, place: (
        Parameter("volume", "m3", lognormal(5e-5 * (rig.line[-1].diameter / 0.02) ** 3, 1.2)),
    ),
    places=load_place,
    apply=_apply,
    apply_in_time=_apply_in_time,
)
