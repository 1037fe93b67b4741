"""A worn valve plate: every chamber under pressure leaks across the plate to the suction side.

All pistons meet the same plate, so the fault makes no orders but the pistons', and no piston can be
told. That is also what a changed line or load looks like, so it is tried on demand only.
"""

from __future__ import annotations

from rippletwin.diagnosis.faults.base import Fault
from rippletwin.pump.faults import Slipper

FAULT = Fault(
    name="valve_plate",
    words="a worn valve plate",
    leaks=lambda area, piston, pistons: [Slipper(area / pistons, k) for k in range(pistons)],
    source="Bergada, Kumar, Davies & Watton 2012, Appl. Math. Model. 36, 1731",
    one_piston=False,
    by_default=False,
)
