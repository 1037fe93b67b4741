"""Faults of the pump as leakage paths between chambers and to the case."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Slipper:
    """A worn slipper: `piston`'s chamber leaks to the case through `leak_area` (m2)."""

    leak_area: float
    piston: int = 0


@dataclass(frozen=True)
class Cylinder:
    """A scratched cylinder block: `leak_area` (m2) joins `piston`'s chamber and the next one's."""

    leak_area: float
    piston: int = 0


def leak_conductances(geometry, fluid, fault):
    """Conductances, m3/s/sqrt(Pa), from each chamber to the case and to the next one, both
    (pistons,).

    `fault` is one of `Slipper` and `Cylinder`, several of them, or None.
    """
    faults = [] if fault is None else [fault] if isinstance(fault, Slipper | Cylinder) else fault
    case_leak, cross_leak = np.zeros((2, geometry.pistons))
    for item in faults:
        leak = case_leak if isinstance(item, Slipper) else cross_leak
        leak[item.piston % geometry.pistons] += orifice_conductance(
            fluid, item.leak_area, geometry.leak_discharge
        )
    return case_leak, cross_leak


def orifice_conductance(fluid, area, discharge_coefficient):
    """Cd A sqrt(2/rho), m3/s/sqrt(Pa), of an orifice of `area` A, m2."""
    return discharge_coefficient * area * np.sqrt(2 / fluid.density)
