"""The flow of an ideal pump, which the lumped pump model approaches for a stiff fluid."""

from __future__ import annotations

import numpy as np

from rippletwin.pump.geometry import Geometry


def kinematic_flow(pump: dict, speed_rpm: float, angle_deg: np.ndarray) -> np.ndarray:
    """Flow (M,) in m3/s of a leak-free pump with an incompressible fluid and ideal ports.

    pump        keys of rig.yaml
    angle_deg   (M,) shaft angles

    It is the sum of the displacing pistons' speeds times their area (Ivantysyn and Ivantysynova
    2001, Hydrostatic Pumps and Motors, ch. 2).
    """
    geometry = Geometry.from_dict(pump)
    k = np.arange(geometry.pistons)[:, None]
    phi = np.radians(angle_deg) - 2 * np.pi * k / geometry.pistons
    rate = -geometry.volume_slope(phi) * speed_rpm * np.pi / 30
    return np.maximum(rate, 0.0).sum(axis=0)
