"""A volume just before the load: the valve block, a reservoir."""

from __future__ import annotations

from rippletwin.effects.base import Effect, Parameter, load_place, lognormal
from rippletwin.effects.line_volume import volume_admittance
from rippletwin.line.chain import Insert


def _apply(network, line, values, place):
    admittance = volume_admittance(network.s, values["volume"], line.density, line.wave_speeds[-1])
    network.inserts.append(Insert(network.length, "shunt", admittance))


EFFECT = Effect(
    name="load_volume",
    element="load",
    medium="any",
    equation="Y_load + s V/(rho a^2)",
    source="Johnston & Edge 1991, Proc. IMechE 205(I):89 (load with an entry volume)",
    time_domain="dp/dt = (rho a^2/V)(q - q_load) at the last node, trapezoidal",
    parameters=lambda rig, place: (
        Parameter("volume", "m3", lognormal(5e-5 * (rig.line[-1].diameter / 0.02) ** 3, 1.2)),
    ),
    places=load_place,
    apply=_apply,
)
