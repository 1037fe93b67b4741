"""A worn slipper: one chamber leaks to the case while it is under pressure."""

from __future__ import annotations

from rippletwin.diagnosis.faults.base import Fault
from rippletwin.pump.faults import Slipper

FAULT = Fault(
    name="slipper",
    words="a worn slipper",
    leaks=lambda area, piston, pistons: [Slipper(area, piston)],
    source="Bergada, Kumar, Davies & Watton 2012, Appl. Math. Model. 36, 1731",
)
