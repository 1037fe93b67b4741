"""Unsteady (frequency-dependent) laminar friction in place of the steady Hagen-Poiseuille loss."""

from __future__ import annotations

import numpy as np

from rippletwin.line.frequency_domain.pipe_immittance import scaled_friction
from rippletwin.twin.effects.base import Effect, line_place


def friction_excess(s, viscosity, diameter, density):
    """Z'_unsteady - Z'_steady, Pa s/m4, broadcast over a batch of viscosities and diameters.

    Bessel functions take the time: they are evaluated once for each distinct nu/R^2 of the batch.
    """
    rate = 4.0 * viscosity / diameter**2
    if np.ndim(rate):
        distinct, inverse = np.unique(rate, return_inverse=True)
        excess = np.stack([nu * (scaled_friction(s / nu) - 8.0) - s for nu in distinct])
        excess = excess[np.ravel(inverse)]
    else:
        excess = rate * (scaled_friction(s / rate) - 8.0) - s
    return excess * density / (0.25 * np.pi * diameter**2)


def _apply(network, state, values, place):
    for k, diameter in enumerate(state.diameters):
        network.series[k] = network.series[k] + friction_excess(
            network.s, state.viscosity, diameter, state.density
        )


def _apply_in_time(line, state, values, place):
    line.friction = "unsteady"  # Zielke's weights as a sum of exponentials


EFFECT = Effect(
    name="unsteady_friction",
    element="line",
    medium="any",
    equation="Z' = (rho/A) s I0(r)/I2(r), r = R sqrt(s/nu), instead of (rho/A)(s + 8 nu/R^2); "
    "no parameter beyond the fluid's viscosity",
    source="Zielke 1968, J. Basic Eng. 90:109, eq. 7; for a gas Kirchhoff 1868",
    parameters=lambda rig, place: (),
    places=line_place,
    apply=_apply,
    apply_in_time=_apply_in_time,
    friction="unsteady",
    usual=True,
)
