"""A sensor with a resonance: its own, or that of the cavity and passage before it."""

from __future__ import annotations

import numpy as np

from rippletwin.effects.base import Effect, Parameter, lognormal, scale_sensor, sensor_places


def _apply(network, line, values, place):
    s, w = network.s, 2.0 * np.pi * values["natural_frequency"]
    response = w**2 / (s**2 + 2.0 * values["damping_ratio"] * w * s + w**2)
    scale_sensor(network, place.index, response)


EFFECT = Effect(
    name="sensor_dynamics",
    element="sensor",
    medium="any",
    equation="reading = w0^2/(s^2 + 2 zeta w0 s + w0^2) p",
    source="Holman 2011, Experimental Methods for Engineers, sec. 2.7 and 6.5",
    time_domain="second-order state driven by the pressure, integrated exactly over a step",
    parameters=lambda rig, place: (
        Parameter("natural_frequency", "Hz", lognormal(5000.0, 0.7), (-1.0, 0.5)),
        Parameter("damping_ratio", "1", lognormal(0.2, 0.9)),
    ),
    places=sensor_places,
    apply=_apply,
)
