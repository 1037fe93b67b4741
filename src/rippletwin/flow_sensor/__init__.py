"""Virtual flow sensors: the flow at the pump outlet from the pressure along the line."""

from rippletwin.flow_sensor.estimate import FlowEstimate, band_limit
from rippletwin.flow_sensor.line import network_of
from rippletwin.flow_sensor.spectral import estimate_flow

__all__ = ["FlowEstimate", "band_limit", "estimate_flow", "network_of"]
