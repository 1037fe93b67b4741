"""A case: the rig and the recordings a user gives, read and checked."""

from rippletwin.case.load import load_case
from rippletwin.case.model import (
    STATE_CODES,
    Case,
    FlowRipple,
    Fluid,
    Load,
    Recording,
    Rig,
    Segment,
    Sensor,
    Uncertainty,
)

__all__ = [
    "STATE_CODES",
    "Case",
    "FlowRipple",
    "Fluid",
    "Load",
    "Recording",
    "Rig",
    "Segment",
    "Sensor",
    "Uncertainty",
    "load_case",
]
