"""Unsteady (frequency-dependent) laminar friction in place of the steady Hagen-Poiseuille loss.

It is in every line: only data that are 20 to 1 against it keep it out.
"""

from __future__ import annotations

import numpy as np

from rippletwin.line.frequency_domain.pipe_immittance import scaled_friction
from rippletwin.twin.effects.base import Effect, line_place


def friction_excess(s, viscosity, diameter, density):
    """Z'_unsteady - Z'_steady (..., F), Pa s/m4, at s (F,); `viscosity` and `diameter` broadcast to
    (..., F) or (..., 1), m2/s and m."""
    rate = 4.0 * viscosity / diameter**2  # nu/R^2
    if np.ndim(rate) <= 2:
        excess = rate * (scaled_friction(s / rate) - 8.0) - s
    else:  # a batch has few distinct rows, and friction takes long
        rows = rate.reshape(-1, rate.shape[-1])
        key = rows @ np.sqrt(np.arange(1.0, rows.shape[1] + 1.0))
        _, first, inverse = np.unique(key, return_index=True, return_inverse=True)
        distinct = rows[first]
        excess = distinct * (scaled_friction(s / distinct) - 8.0) - s
        excess = excess[inverse.ravel()].reshape(*rate.shape[:-1], -1)
    return excess * (density / (0.25 * np.pi)) / diameter**2


def _apply(network, state, values, place):
    diameters = np.asarray(state.diameters)
    batch = (1,) * (np.ndim(network.series) - diameters.ndim)
    diameters = diameters.reshape(diameters.shape + batch)
    network.series = network.series + friction_excess(
        network.s, state.viscosity, diameters, state.density
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
    usual=lambda rig, place: True,
    certain=lambda rig, place: True,
)
