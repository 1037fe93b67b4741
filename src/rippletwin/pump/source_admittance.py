"""Admittance of the pump as a source: the compliance of the chambers open to delivery.

A chamber open to delivery responds to the outlet pressure through its port. Per unit of outlet
pressure it takes in the flow

    Y_k(s) = 1 / (1/G_k + 1/(s C_k)),     G_k = dq/dp of the port at this crank angle,
    C_k = V_k (1/B + x p0/p_k^2)          of the liquid with its air, as in `simulation`.

Ports and volumes vary with the shaft angle. A harmonic's response at its own frequency is the mean
over a revolution: the diagonal of the harmonic transfer matrix (Wereley 1991, Analysis and Control
of Linear Periodically Time Varying Systems, ch. 3). With the flow into a constant pressure this is
the pump's Norton source (Johnston & Drew 1996, Proc. IMechE I 210, 65).
"""

from __future__ import annotations

import numpy as np

from rippletwin.case.model import ATMOSPHERE, absolute
from rippletwin.pump.geometry import Geometry

LINEAR_DROP = 1e3  # Pa, below which a port's orifice law is taken as linear
ANGLES_PER_REVOLUTION = 360  # of the mean


def source_admittance(
    geometry: Geometry, density: float, pressure: float, chamber_pressure: np.ndarray, s: np.ndarray
) -> np.ndarray:
    """Mean admittance (F,), m3/s/Pa, of the pump seen from its outlet at `s` (F,), 1/s.

    `chamber_pressure` (pistons, M), Pa, over one revolution from `simulate`; `pressure` is the
    mean outlet pressure, Pa.
    """
    samples = chamber_pressure.shape[1]
    at = np.arange(ANGLES_PER_REVOLUTION) * samples // ANGLES_PER_REVOLUTION
    phi = 2 * np.pi * at / samples
    lag = 2 * np.pi * np.arange(geometry.pistons)[:, None] / geometry.pistons
    area = geometry.delivery_area(phi - lag)
    drop = np.abs(chamber_pressure[:, at] - pressure)
    port = geometry.discharge_coefficient * area * np.sqrt(2 / density)
    port = port / (2 * np.sqrt(drop + LINEAR_DROP))
    air = geometry.air_fraction * ATMOSPHERE / absolute(chamber_pressure[:, at]) ** 2
    compliance = geometry.volume(phi - lag) * (1.0 / geometry.bulk_modulus + air)
    s = np.asarray(s)[:, None, None]
    return np.sum(port * s * compliance / (port + s * compliance), axis=1).mean(axis=-1)
