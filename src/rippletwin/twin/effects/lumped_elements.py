"""Formulas of lumped elements that several effects share."""

from __future__ import annotations

import numpy as np
from scipy.special import binom

from rippletwin.twin.parameters import Parameter
from rippletwin.twin.priors import normal

REFERENCE_PRESSURE = 1e7  # Pa absolute, at which volumes of gas are stated
SERIES_TERMS = 6  # of a gas in x = p/mean; the next is 1e-3 of the second at x = 0.3
POLYTROPIC_EXPONENT = 1.2  # 1 at one temperature, 1.4 where there is no time to exchange heat


def volume_compliance(volume, density, wave_speed):
    """V/(rho a^2), m3/Pa: what a volume stores per unit of pressure; its admittance is s times it.

    Wylie & Streeter 1993, Fluid Transients in Systems, sec. 12.5 (lumped capacitance).
    """
    return volume / (density * wave_speed**2)


def polytropic_parameter() -> Parameter:
    """The polytropic exponent of a gas in oil."""
    return Parameter("polytropic_exponent", "1", normal(POLYTROPIC_EXPONENT, 0.12))


def gas_volume_at(volume, exponent, pressure):
    """V, m3, at `pressure`, Pa absolute, of gas whose volume is `volume`, m3, at 10 MPa:
    V = volume (10 MPa/p)^(1/n) with the polytropic `exponent` n."""
    return volume * (REFERENCE_PRESSURE / pressure) ** (1.0 / exponent)


def gas_compliance(volume, exponent, pressure):
    """V/(n p), m3/Pa, of gas at `pressure`, Pa absolute, whose volume is `volume`, m3, at 10 MPa.

    From p V^n = const; Wylie & Streeter 1993, Fluid Transients in Systems (air chamber).
    """
    return gas_volume_at(volume, exponent, pressure) / (exponent * pressure)


def gas_series(volume, exponent):
    """[c_1, c_2 ...] of the volume sum_k c_k x^k by which gas of `volume` at a mean pressure is
    compressed where the pressure is x times the mean above it: of -V ((1 + x)^(-1/n) - 1).

    Shape and unit are those of `volume`, a share of a volume for example; n is the `exponent`.
    """
    return [-volume * binom(-1.0 / exponent, k) for k in range(1, SERIES_TERMS + 1)]


def second_order_lag(s, natural_frequency, damping_ratio):
    """w0^2/(s^2 + 2 zeta w0 s + w0^2), `natural_frequency` in Hz, of a mass on a spring."""
    w = 2.0 * np.pi * natural_frequency
    return w**2 / (s**2 + 2.0 * damping_ratio * w * s + w**2)
