"""A sensor with a resonance: its own, or that of the cavity and passage before it."""

from __future__ import annotations

from rippletwin.twin.effects.base import Effect, scale_sensor, sensor_places
from rippletwin.twin.effects.lumped_elements import second_order_lag
from rippletwin.twin.parameters import Parameter
from rippletwin.twin.priors import lognormal


def _apply(network, state, values, place):
    scale_sensor(network, place.index, second_order_lag(network.s, **values))


def _apply_in_time(line, state, values, place):
    line.sensors.append((place.index, lambda s: second_order_lag(s, **values)))


EFFECT = Effect(
    name="sensor_dynamics",
    element="sensor",
    medium="any",
    equation="reading = w0^2/(s^2 + 2 zeta w0 s + w0^2) p",
    source="Holman 2011, Experimental Methods for Engineers, sec. 2.7 and 6.5",
    parameters=lambda rig, place: (
        Parameter("natural_frequency", "Hz", lognormal(5000.0, 0.7), (-1.0, 0.5)),
        Parameter("damping_ratio", "1", lognormal(0.2, 0.9)),
    ),
    places=sensor_places,
    apply=_apply,
    apply_in_time=_apply_in_time,
)
