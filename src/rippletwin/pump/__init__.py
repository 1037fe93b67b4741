"""The lumped chamber pump: from geometry and leaks to the flow ripple at the outlet."""

from rippletwin.pump.geometry import Geometry, kinematic_flow
from rippletwin.pump.simulation import (
    ConstantPressure,
    Cylinder,
    Pipe,
    PressureWave,
    PumpRipple,
    Slipper,
    simulate,
)
from rippletwin.pump.uncertain import RippleChange, ripple_change

__all__ = [
    "ConstantPressure",
    "Cylinder",
    "Geometry",
    "Pipe",
    "PressureWave",
    "PumpRipple",
    "RippleChange",
    "Slipper",
    "kinematic_flow",
    "ripple_change",
    "simulate",
]
