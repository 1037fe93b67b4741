"""A scratched cylinder block: two neighbouring chambers are connected."""

from __future__ import annotations

from rippletwin.diagnosis.faults.base import Fault
from rippletwin.pump.faults import Cylinder

FAULT = Fault(
    name="cylinder",
    words="a scratched cylinder block",
    leaks=lambda area, piston, pistons: [Cylinder(area, piston)],
    source="Bergada, Kumar, Davies & Watton 2012, Appl. Math. Model. 36, 1731",
)
