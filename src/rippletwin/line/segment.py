"""Series impedance and shunt admittance of a pipe segment, per metre.

Laminar flow in a round pipe, long waves (wavelength much greater than the diameter):

    -dp/dx = Z'(s) q,    -dq/dx = Y'(s) p

Sources: Zielke (1968), J. Basic Eng. 90, 109, eq. 7 for the exact laminar friction;
Stecki & Davis (1986), Proc. IMechE 200(A4), 215, for the comparison of the friction models.
"""

from __future__ import annotations

import numpy as np
from scipy.special import ive

FRICTIONS = ("none", "steady", "unsteady")

_SERIES_RADIUS = 0.05  # |r| below which s I0/I2 is summed as a power series (error < 1e-15)


def series_impedance(
    s: np.ndarray, *, density: float, viscosity: float, diameter: float, friction: str = "unsteady"
) -> np.ndarray:
    """Series impedance Z'(s) of a full pipe in Pa s/m4, shape of `s`.

    `s` in 1/s (complex, s = 0 allowed), `density` in kg/m3, kinematic `viscosity` in m2/s,
    `diameter` in m. `friction`:

    * "none":     Z' = (rho/A) s
    * "steady":   Z' = (rho/A) (s + 32 nu/D^2)           Hagen-Poiseuille at every frequency
    * "unsteady": Z' = (rho/A) s I0(r)/I2(r), r = R sqrt(s/nu)   exact laminar (Zielke 1968, eq. 7)

    Raises ValueError for another `friction`.
    """
    s = np.asarray(s, dtype=complex)
    inertance = density / (0.25 * np.pi * diameter**2)
    if friction == "none":
        return inertance * s
    if friction == "steady":
        return inertance * (s + 32.0 * viscosity / diameter**2)
    if friction == "unsteady":
        rate = 4.0 * viscosity / diameter**2  # nu/R^2
        return inertance * rate * scaled_friction(s / rate)
    raise ValueError(f"friction must be one of {FRICTIONS}, not {friction!r}")


def shunt_admittance(
    s: np.ndarray, *, density: float, wave_speed: float, diameter: float
) -> np.ndarray:
    """Shunt admittance Y'(s) = A s/(rho a^2) in m2/(Pa s), shape of `s`."""
    area = 0.25 * np.pi * diameter**2
    return np.asarray(s, dtype=complex) * (area / (density * wave_speed**2))


def scaled_friction(sigma: np.ndarray) -> np.ndarray:
    """sigma I0(r)/I2(r) with r = sqrt(sigma), the laminar friction in units of nu/R^2.

    `sigma` = s R^2/nu, any shape. Exponentially scaled Bessel functions keep it finite to
    |r| = 1e4 and beyond; near zero, where I2 vanishes as r^2/8, its power series
    8 + 4 sigma/3 - sigma^2/36 + ... stands in.
    """
    sigma = np.asarray(sigma, dtype=complex)
    r = np.sqrt(sigma)
    small = np.abs(r) < _SERIES_RADIUS
    if not small.any():
        return sigma * ive(0, r) / ive(2, r)
    safe = np.where(small, 1.0, r)
    exact = sigma * ive(0, safe) / ive(2, safe)
    # I0 = sum (sigma/4)^k/k!^2 and I2 = (sigma/4)/2 sum 2 (sigma/4)^k/(k! (k+2)!)
    z = 0.25 * sigma
    i0 = 1.0 + z * (1.0 + z * (1.0 / 4.0 + z / 36.0))
    i2 = 0.5 + z * (1.0 / 6.0 + z * (1.0 / 48.0 + z / 720.0))
    return np.where(small, 4.0 * i0 / i2, exact)
