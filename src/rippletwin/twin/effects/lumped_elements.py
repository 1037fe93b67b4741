"""Formulas of lumped elements that several effects share."""

from __future__ import annotations

import numpy as np

REFERENCE_PRESSURE = 1e7  # Pa absolute, at which volumes of gas are stated
POLYTROPIC_EXPONENT = 1.2  # 1 at one temperature, 1.4 where there is no time to exchange heat


def volume_compliance(volume, density, wave_speed):
    """V/(rho a^2), m3/Pa: what a volume stores per unit of pressure; its admittance is s times it.

    Wylie & Streeter 1993, Fluid Transients in Systems, sec. 12.5 (lumped capacitance).
    """
    return volume / (density * wave_speed**2)


def gas_compliance(volume, exponent, pressure):
    """V/(n p), m3/Pa, of gas at `pressure`, Pa absolute, whose volume is `volume`, m3, at 10 MPa:
    V = volume (10 MPa/p)^(1/n) with the polytropic `exponent` n.

    From p V^n = const; Wylie & Streeter 1993, Fluid Transients in Systems (air chamber).
    """
    return volume * (REFERENCE_PRESSURE / pressure) ** (1.0 / exponent) / (exponent * pressure)


def second_order_lag(s, natural_frequency, damping_ratio):
    """w0^2/(s^2 + 2 zeta w0 s + w0^2), `natural_frequency` in Hz, of a mass on a spring."""
    w = 2.0 * np.pi * natural_frequency
    return w**2 / (s**2 + 2.0 * damping_ratio * w * s + w**2)
