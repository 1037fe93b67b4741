"""Series impedance and shunt admittance of a pipe segment, per metre.

Laminar flow in a round pipe, long waves (wavelength much greater than the diameter):

    -dp/dx = Z'(s) q,    -dq/dx = Y'(s) p

Sources: Zielke (1968), J. Basic Eng. 90, 109, eq. 7 for the exact laminar friction;
Stecki & Davis (1986), Proc. IMechE 200(A4), 215, for the comparison of the friction models.
"""

from __future__ import annotations

import numpy as np
from numba import njit

FRICTION_LAWS = ("none", "steady", "unsteady")


def series_impedance(
    s: np.ndarray,
    *,
    density: float,
    viscosity: np.ndarray | float,
    diameter: float,
    friction: str = "unsteady",
) -> np.ndarray:
    """Series impedance Z'(s) of a full pipe in Pa s/m4.

    `s` in 1/s (complex, s = 0 allowed), `density` in kg/m3, kinematic `viscosity` in m2/s,
    `diameter` in m; all broadcast, so that diameters (n, 1) with s (F,) give (n, F).
    `friction`:

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
    raise ValueError(f"friction must be one of {FRICTION_LAWS}, not {friction!r}")


def shunt_admittance(
    s: np.ndarray,
    *,
    density: float,
    wave_speed: float | np.ndarray,
    diameter: float | np.ndarray,
) -> np.ndarray:
    """Shunt admittance Y'(s) = A s/(rho a^2) in m2/(Pa s).

    `s` in 1/s, `density` in kg/m3, `wave_speed` in m/s, `diameter` in m; all broadcast.
    """
    area = 0.25 * np.pi * diameter**2
    return np.asarray(s, dtype=complex) * (area / (density * wave_speed**2))


def scaled_friction(sigma: np.ndarray) -> np.ndarray:
    """sigma I0(r)/I2(r) with r = sqrt(sigma), the laminar friction in units of nu/R^2.

    `sigma` = s R^2/nu, any shape, Re r >= 0. Finite to |r| = 1e4 and far beyond: Hankel's
    asymptotic series (Abramowitz & Stegun 1964, 9.7.1) where it has reached rounding. Elsewhere the
    continued fraction of the ratio of Bessel functions (ibid. 9.1.73 with an imaginary argument):

        sigma I0/I2 = sigma + 8 + 2 rho_2,    rho_n = sigma/(2 (n + 1) + rho_(n+1))
    """
    sigma = np.asarray(sigma, dtype=complex)
    return _scaled_friction(sigma.ravel()).reshape(sigma.shape)


def _asymptotic_ratio(terms: int) -> np.ndarray:
    """Coefficients c_k of I0(r)/I2(r) = sum_k c_k r^-k, from Hankel's series of each."""
    top, bottom = ([1.0], [1.0])
    for order, series in ((0, top), (2, bottom)):
        for k in range(1, terms):
            series.append(series[-1] * -(4 * order**2 - (2 * k - 1) ** 2) / (8 * k))
    ratio: list[float] = []
    for k in range(terms):
        ratio.append(top[k] - sum(ratio[i] * bottom[k - i] for i in range(k)))
    return np.array(ratio)


_LARGE_RADIUS = 18.0  # above this Re r the asymptotic series is exact to rounding
_ASYMPTOTIC = _asymptotic_ratio(18)
_FIRST_DEPTH, _DEPTH_PER_RADIUS = 20, 1.2  # of the continued fraction: depth at r = 0, more by |r|


@njit(cache=True)
def _scaled_friction(sigma):
    values = np.empty_like(sigma)
    for i in range(len(sigma)):
        r = np.sqrt(sigma[i])
        value = 0j
        if r.real > _LARGE_RADIUS:
            x = 1.0 / r
            for c in _ASYMPTOTIC[::-1]:
                value = value * x + c
            values[i] = sigma[i] * value
        else:
            for n in range(int(_FIRST_DEPTH + _DEPTH_PER_RADIUS * abs(r)), 1, -1):
                value = sigma[i] / (2.0 * (n + 1) + value)
            values[i] = sigma[i] + 8.0 + 2.0 * value
    return values
