"""The lumped chamber pump: from geometry and leaks to the flow ripple at the outlet."""

from rippletwin.pump.geometry import Geometry, kinematic_flow
from rippletwin.pump.simulation import (
    ConstantPressure,
    Cylinder,
    Pipe,
    PumpRipple,
    Slipper,
    simulate,
)

__all__ = [
    "ConstantPressure",
    "Cylinder",
    "Geometry",
    "Pipe",
    "PumpRipple",
    "Slipper",
    "kinematic_flow",
    "simulate",
]
