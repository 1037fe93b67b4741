"""Wave speed in a filled pipe from the liquid's bulk modulus, the bore and the wall."""

from __future__ import annotations

import math

YOUNGS_MODULUS = {"steel": 207e9, "stainless": 193e9, "copper": 117e9, "aluminium": 69e9}
"""Young's modulus of a wall's material, Pa."""
POISSON_RATIO = 0.3


def wave_speed(
    density: float,
    bulk_modulus: float,
    bore: float,
    wall: float | None = None,
    youngs_modulus: float = YOUNGS_MODULUS["steel"],
) -> float:
    """Speed of a pressure wave, m/s; without `wall` that in the free liquid.

    Korteweg (1878), Annalen der Physik 241, 525-542, with the thick wall's factor of Wylie &
    Streeter (1993), Fluid Transients in Systems, for a pipe that is free to expand
    lengthwise:

        a = sqrt(K/rho) / sqrt(1 + (K/E)(D/e) c),   c = 2 (e/D)(1 + mu) + D/(D + e)

    Joukowsky (1898) found it in water mains. Free gas and a hose's rubber lower it much further:
    for these give the measured wave speed.

    density      rho, kg/m3, at the working temperature
    bulk_modulus K, Pa, of the liquid with what gas it holds, isentropic
    bore, wall   D and e, m
    youngs_modulus  E, Pa

    Raises
    ------
    ValueError : a number is not positive.
    """
    given = (density, bulk_modulus, bore, youngs_modulus, 1.0 if wall is None else wall)
    if not all(math.isfinite(value) and value > 0 for value in given):
        raise ValueError("density, bulk modulus, bore, wall and Young's modulus are positive")
    free = math.sqrt(bulk_modulus / density)
    if wall is None:
        return free
    factor = 2 * wall / bore * (1 + POISSON_RATIO) + bore / (bore + wall)
    return free / math.sqrt(1 + bulk_modulus / youngs_modulus * bore / wall * factor)
