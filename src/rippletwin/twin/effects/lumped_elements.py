"""Lumped elements that several effects share: formulas, and a volume at a position."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rippletwin.line.frequency_domain.line_network import Insert
from rippletwin.line.time_domain.line_elements import capacitance
from rippletwin.twin.effects.base import on_line, segment_at
from rippletwin.twin.parameters import Parameter
from rippletwin.twin.priors import normal

REFERENCE_PRESSURE = 1e7  # Pa absolute, at which volumes of gas are stated
POLYTROPIC_EXPONENT = 1.2  # 1 at one temperature, 1.4 where there is no time to exchange heat


def volume_compliance(volume, density, wave_speed):
    """V/(rho a^2), m3/Pa: what a volume stores per unit of pressure; its admittance is s times it.

    Wylie & Streeter 1993, Fluid Transients in Systems, sec. 12.5 (lumped capacitance).
    """
    return volume / (density * wave_speed**2)


def polytropic_parameter() -> Parameter:
    """The polytropic exponent of a gas in oil."""
    return Parameter("polytropic_exponent", "1", normal(POLYTROPIC_EXPONENT, 0.12))


def capacitance_at_position(compliance: Callable) -> tuple[Callable, Callable]:
    """`apply` and `apply_in_time` of an effect that stores liquid at its position, q1 - q2 = s C p.

    compliance   (state, k, values) -> C, m3/Pa, in segment k
    """

    def apply(network, state, values, place):
        k = segment_at(network.lengths, values["position"])
        admittance = network.s * compliance(state, k, values)
        position = on_line(network, values["position"])
        network.inserts.append(Insert(position, "shunt", admittance))

    def apply_in_time(line, state, values, place):
        k = segment_at([pipe.length for pipe in line.pipes], values["position"])
        position = on_line(line, values["position"])
        line.inserts.append(capacitance(position, float(compliance(state, k, values))))

    return apply, apply_in_time


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
