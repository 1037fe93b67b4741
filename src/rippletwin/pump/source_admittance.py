"""What the pump is to the line besides a flow: the compliance of the chambers that face it.

A chamber open to delivery answers the line's pressure through its port: per unit of outlet
pressure it takes in

    Y_k(s) = 1 / (1/G_k + B/(s V_k)),     G_k = dq/dp of the port at this crank angle.

Ports and volumes turn with the shaft; what a harmonic meets of its own frequency is the mean over
a revolution (the diagonal of the harmonic transfer matrix; Wereley 1991, Analysis and Control of
Linear Periodically Time Varying Systems, ch. 3). With the flow into a constant pressure this makes
the pump's Norton source (Johnston & Drew 1996, Proc. IMechE I 210, 137).
"""

from __future__ import annotations

import numpy as np

from rippletwin.pump.geometry import Geometry

SHARP = 1e3  # Pa, below which a port's orifice law is taken as linear
ANGLES = 360  # of the mean over a revolution


def source_admittance(
    geometry: Geometry, density: float, pressure: float, chamber_pressure: np.ndarray, s: np.ndarray
) -> np.ndarray:
    """Mean admittance (F,), m3/s/Pa, of the pump seen from its outlet at `s` (F,), 1/s.

    `chamber_pressure` (pistons, M), Pa, over one revolution from `simulate`; `pressure` is the
    mean outlet pressure, Pa.
    """
    samples = chamber_pressure.shape[1]
    at = np.arange(ANGLES) * samples // ANGLES
    phi = 2 * np.pi * at / samples
    lag = 2 * np.pi * np.arange(geometry.pistons)[:, None] / geometry.pistons
    area = geometry.delivery_area(phi - lag)
    drop = np.abs(chamber_pressure[:, at] - pressure)
    port = geometry.discharge_coefficient * area * np.sqrt(2 / density)
    port = port / (2 * np.sqrt(drop + SHARP))
    compliance = geometry.volume(phi - lag) / geometry.bulk_modulus
    s = np.asarray(s)[:, None, None]
    return np.sum(port * s * compliance / (port + s * compliance), axis=1).mean(axis=-1)
