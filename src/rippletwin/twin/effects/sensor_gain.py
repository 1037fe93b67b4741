"""A sensor with a wrong calibration factor. Without a known source only ratios show."""

from __future__ import annotations

from rippletwin.twin.effects.base import Effect, scale_sensor, sensor_places
from rippletwin.twin.parameters import Parameter
from rippletwin.twin.priors import normal


def _apply(network, state, values, place):
    scale_sensor(network, place.index, 1.0 + values["gain_error"] + 0.0 * network.s)


def _apply_in_time(line, state, values, place):
    line.sensors.append((place.index, lambda s: 1.0 + values["gain_error"] + 0.0 * s))


EFFECT = Effect(
    name="sensor_gain",
    element="sensor",
    medium="any",
    equation="reading = (1 + g) p",
    source="JCGM 106:2012, sec. 5 (sensitivity error)",
    parameters=lambda rig, place: (Parameter("gain_error", "1", normal(0.0, 0.15)),),
    # An uncalibrated sensor has its gain among the parameters of the line.
    places=lambda rig: () if rig.uncertainty.sensor_gain else sensor_places(rig),
    apply=_apply,
    apply_in_time=_apply_in_time,
)
