"""A mineral oil's density and viscosity at the working temperature, from its data sheet."""

from __future__ import annotations

import math

KELVIN = 273.15
EXPANSION = 7e-4
"""Thermal expansion of mineral oil, 1/K: Totten & De Negri (2011), Handbook of Hydraulic Fluid
Technology, 2nd ed., ch. 4."""
THINNEST = 0.3
"""cSt; from there down log log (nu + 0.7), and with it Walther's law, has no value."""
SHEET_TEMPERATURE = 15.0  # degrees Celsius at which a data sheet states the density


def density_at(density_15: float, celsius: float) -> float:
    """Density, kg/m3, at a temperature, from that at 15 degrees Celsius."""
    return density_15 / (1 + EXPANSION * (celsius - SHEET_TEMPERATURE))


def viscosity_at(viscosity_40: float, viscosity_100: float, celsius: float) -> float:
    """Kinematic viscosity, cSt, at a temperature, from those at 40 and 100 degrees Celsius.

    Ubbelohde and Walther, as in ASTM D341: log log (nu + 0.7) is linear in log T.

    Raises
    ------
    ValueError : the oil is not thinner at 100 degrees, or Walther's law does not hold for it.
    """
    if not viscosity_40 > viscosity_100:
        raise ValueError("an oil is thinner at 100 than at 40 degrees Celsius")
    if not viscosity_100 > THINNEST:
        raise ValueError(
            f"{viscosity_100:g} cSt: Walther's law holds above {THINNEST:g} cSt; give the "
            "viscosity at the working temperature instead"
        )
    high, low = (math.log10(math.log10(v + 0.7)) for v in (viscosity_40, viscosity_100))
    at = [math.log10(c + KELVIN) for c in (40.0, 100.0, celsius)]
    slope = (high - low) / (at[1] - at[0])
    try:
        return 10**10 ** (high - slope * (at[2] - at[0])) - 0.7
    except OverflowError:
        raise ValueError(f"no viscosity follows for {celsius:g} degrees Celsius") from None
