"""A sensor whose channel is late: unsynchronised acquisition, a separate anti-alias filter."""

from __future__ import annotations

import numpy as np

from rippletwin.twin.effects.base import Effect, scale_sensor, sensor_places
from rippletwin.twin.parameters import Parameter
from rippletwin.twin.priors import normal


def _apply(network, state, values, place):
    scale_sensor(network, place.index, np.exp(-network.s * values["delay"]))


def _apply_in_time(line, state, values, place):
    line.sensors.append((place.index, lambda s: np.exp(-s * values["delay"])))


EFFECT = Effect(
    name="sensor_delay",
    element="sensor",
    medium="any",
    equation="reading = exp(-s tau) p",
    source="Oppenheim & Willsky 1997, Signals and Systems, sec. 4.3.2 (time shift)",
    parameters=lambda rig, place: (Parameter("delay", "s", normal(0.0, 1e-4)),),
    places=sensor_places,
    apply=_apply,
    apply_in_time=_apply_in_time,
)
