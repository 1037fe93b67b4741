"""Formulas of lumped elements that several effects share."""

from __future__ import annotations

import numpy as np


def volume_compliance(volume, density, wave_speed):
    """V/(rho a^2), m3/Pa: what a volume stores per unit of pressure; its admittance is s times it.

    Wylie & Streeter 1993, Fluid Transients in Systems, sec. 12.5 (lumped capacitance).
    """
    return volume / (density * wave_speed**2)


def second_order_lag(s, natural_frequency, damping_ratio):
    """w0^2/(s^2 + 2 zeta w0 s + w0^2), `natural_frequency` in Hz, of a mass on a spring."""
    w = 2.0 * np.pi * natural_frequency
    return w**2 / (s**2 + 2.0 * damping_ratio * w * s + w**2)
