"""The default pump at one operating point, and a pipe behind it."""

import numpy as np

from rippletwin.case.model import Fluid, Segment

OIL = Fluid(density=870.0, kinematic_viscosity=3.2e-5)
SPEED = 1000.0
LOAD = 9.5e6
PIPE = Segment(length=5.0, diameter=0.02, wave_speed=1200.0)
POSITIONS = (0.5, 3.0)


def relative_rms(a, b):
    """rms of the difference of the ripples over the rms of b's."""
    a, b = a - a.mean(), b - b.mean()
    return np.sqrt(np.mean((a - b) ** 2) / np.mean(b**2))
