"""Dimensions of the pump, its chambers' volumes and its ports' areas.

A chamber's angle phi is 0 at its outer dead centre (largest volume, start of delivery) and pi at
its inner dead centre. Piston k lags piston 0 by k/pistons of a revolution.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

import numpy as np

from rippletwin.case.model import absolute

LEAK_DISCHARGE = 0.7
"""Discharge coefficient of a leak where the data sheet gives none."""

GROWS_WITH = {
    "dead_volume": "stroke_volume",
    "port_area": "piston_area",
    "case_leakage": "stroke_volume",
}
"""Key -> the size of a pump with which its default grows."""


@dataclass(frozen=True)
class Geometry:
    """The keys of rig.yaml's `pump`, SI units; defaults describe a pump of 42 cm3/rev, see
    docs/explanation/pump.md for their origin. `from_dict` scales those of GROWS_WITH to the pistons
    of another pump. `leak_discharge` is no key: it is the `discharge_coefficient` that the data
    sheet states, else LEAK_DISCHARGE."""

    pistons: int = 9
    piston_diameter: float = 0.017
    pitch_radius: float = 0.0335
    swash_angle_deg: float = 17.0
    dead_volume: float = 3.5e-6  # of a chamber at the inner dead centre, m3
    bulk_modulus: float = 1.4e9  # of the liquid, Pa
    air_fraction: float = 5e-4  # undissolved air, volume at ATMOSPHERE over liquid volume
    port_area: float = 1.2e-4  # of a fully open port, m2
    port_opening_deg: float = 30.0  # from closed to fully open
    port_overlap_deg: float = 5.0  # both ports closed about each dead centre; negative: both open
    port_timing_deg: float = 0.0  # angle by which the port plate is turned, later being positive
    discharge_coefficient: float = 0.65
    case_leakage: float = 3e-13  # laminar, of a chamber, m3/s/Pa
    suction_pressure: float = 0.0  # gauge, also that of the case, Pa: an open tank
    leak_discharge: float = LEAK_DISCHARGE

    @classmethod
    def from_dict(cls, pump: dict) -> Geometry:
        """Geometry from rig.yaml's `pump`. Raises ValueError for an unknown key and an impossible
        value."""
        known = [field.name for field in fields(cls) if field.name != "leak_discharge"]
        unknown = sorted(set(pump) - set(known))
        if unknown:
            raise ValueError(f"unknown pump keys {unknown}; known are {known}")
        stated = stated_numbers(pump)
        leak_discharge = stated.get("discharge_coefficient", LEAK_DISCHARGE)
        geometry, default = cls(**stated, leak_discharge=leak_discharge), cls()
        scaled = {
            name: getattr(default, name) * getattr(geometry, size) / getattr(default, size)
            for name, size in GROWS_WITH.items()
            if name not in stated
        }
        geometry = replace(geometry, **scaled)
        may_be_negative = ("port_timing_deg", "port_overlap_deg", "suction_pressure")
        may_be_zero = ("air_fraction", "case_leakage")
        for name in known:
            value = getattr(geometry, name)
            if name in may_be_negative:
                continue
            if value < 0.0 or (value == 0.0 and name not in may_be_zero):
                raise ValueError(f"pump key {name} = {value} must be positive")
        if absolute(geometry.suction_pressure) <= 0.0:
            raise ValueError(
                f"pump key suction_pressure = {geometry.suction_pressure}, a gauge pressure, must "
                "be above that of a vacuum"
            )
        if abs(geometry.port_overlap_deg) >= 180.0:
            raise ValueError(
                f"pump key port_overlap_deg = {geometry.port_overlap_deg} must be between -180 "
                "and 180"
            )
        return geometry

    @property
    def piston_area(self) -> float:
        """Area of a piston, m2."""
        return np.pi * self.piston_diameter**2 / 4

    @property
    def stroke_volume(self) -> float:
        """What one piston displaces in one revolution, m3: A_p 2 R tan(alpha)."""
        stroke = 2 * self.pitch_radius * np.tan(np.radians(self.swash_angle_deg))
        return self.piston_area * stroke

    @property
    def displacement(self) -> float:
        """What the pump displaces in one revolution, m3."""
        return self.pistons * self.stroke_volume

    def volume(self, phi: np.ndarray) -> np.ndarray:
        """Chamber volume, m3, at angles `phi`, rad, same shape."""
        return self.dead_volume + 0.5 * self.stroke_volume * (1 + np.cos(phi))

    def volume_slope(self, phi: np.ndarray) -> np.ndarray:
        """dV/dphi, m3/rad, at angles `phi`, rad, same shape."""
        return -0.5 * self.stroke_volume * np.sin(phi)

    def delivery_area(self, phi: np.ndarray) -> np.ndarray:
        """Area of the delivery port, m2, at angles `phi`, rad: open between the dead centres."""
        return self.port_area * self._opening(phi)

    def suction_area(self, phi: np.ndarray) -> np.ndarray:
        """Area of the suction port, m2, at angles `phi`, rad: half a revolution later."""
        return self.port_area * self._opening(phi - np.pi)

    def _opening(self, phi):
        """0 to 1; it starts and ends as the square of the angle, like a triangular relief groove.

        A port that takes more than half of its time to open never opens wholly.

        (Edge & Darling 1989, J. Dyn. Sys. Meas. Control 111, 307, found such grooves best.)
        """
        phi = (np.degrees(phi) - self.port_timing_deg + 90.0) % 360.0 - 90.0  # 90 is its middle
        shut = self.port_overlap_deg / 2
        rising = np.clip((phi - shut) / self.port_opening_deg, 0.0, 1.0)
        falling = np.clip((180.0 - shut - phi) / self.port_opening_deg, 0.0, 1.0)
        return _smooth(rising) * _smooth(falling)


def stated_numbers(pump: Mapping) -> dict:
    """The keys of rig.yaml's `pump` that have a value."""
    return {key: value for key, value in pump.items() if value is not None}


def _smooth(u):
    return u * u * (3 - 2 * u)
