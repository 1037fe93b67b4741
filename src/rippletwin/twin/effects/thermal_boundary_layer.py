"""Heat conduction to the wall of a gas-filled tube: compression is isothermal close to it."""

from __future__ import annotations

from dataclasses import replace

from rippletwin.line.frequency_domain.pipe_immittance import scaled_friction
from rippletwin.line.time_domain.weighting_functions import conduction_terms
from rippletwin.twin.effects.base import Effect, line_place


def thermal_factor(s, viscosity, diameter, heat_capacity_ratio, prandtl):
    """gamma - (gamma - 1) I2(r)/I0(r), r = R sqrt(s Pr/nu): the factor on the adiabatic Y'.

    Broadcast over a batch of viscosities and diameters.
    """
    sigma = 0.25 * diameter**2 * s * prandtl / viscosity
    ratio = sigma / scaled_friction(sigma)
    return heat_capacity_ratio - (heat_capacity_ratio - 1.0) * ratio


def _apply(network, state, values, place):
    for k, diameter in enumerate(state.diameters):
        network.shunt[k] = network.shunt[k] * thermal_factor(
            network.s, state.viscosity, diameter, state.heat_capacity_ratio, state.prandtl
        )


def _apply_in_time(line, state, values, place):
    # The isothermal layer acts as a retarded compliance of the wall, a sum of exponentials.
    for k, diameter in enumerate(state.diameters):
        rate = 4.0 * state.viscosity / (state.prandtl * diameter**2)
        terms = conduction_terms(rate, state.heat_capacity_ratio)
        line.pipes[k] = replace(line.pipes[k], creep=(*line.pipes[k].creep, *terms))


EFFECT = Effect(
    name="thermal_boundary_layer",
    element="line",
    medium="gas",
    equation="Y' = A s/(rho a^2) (gamma - (gamma - 1) I2(r)/I0(r)), r = R sqrt(s Pr/nu); "
    "no parameter beyond those of the gas",
    source="Kirchhoff 1868; Zwikker & Kosten 1949, Sound Absorbing Materials, ch. II; "
    "Tijdeman 1975, J. Sound Vib. 39:1, eq. 32",
    parameters=lambda rig, place: (),
    places=line_place,
    apply=_apply,
    apply_in_time=_apply_in_time,
    usual=lambda rig, place: True,
)
