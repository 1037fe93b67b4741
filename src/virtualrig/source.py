"""The pump's flow into a constant pressure: what a pump model without a line gives.

A rig driven by this flow has an ideal flow source. A volume or a passage at the real outlet is then
an effect of its own and can be concealed.
"""

from collections.abc import Sequence

import numpy as np
from numba import njit

from virtualrig.pump import (
    AIR,
    LAMINAR,
    MOST_NEWTON_STEPS,
    Pump,
    chamber_kinematics,
    compression,
    orifice_flow,
    pump_tables,
    step_chambers,
)

SAMPLES = 18432
"""A revolution; linear interpolation between them errs by 0.1 % at 5 kHz."""

_REVOLUTIONS = 3
_ANGLES = 720  # of a revolution, for a mean over it
_OUTLET_CONDUCTANCE = 1e3  # m3/s/Pa: keeps the outlet within a fraction of a pascal


def constant_pressure_flow(
    pump: Pump,
    density: float,
    speed_rpm: float,
    pressure: float,
    ripple: Sequence[tuple[float, float, float]] = (),
) -> np.ndarray:
    """Delivered flow (SAMPLES,), m3/s, at crank turns k/SAMPLES, at an outlet `pressure` in Pa.

    `ripple` rows (order, relative amplitude of crank speed, phase) as in `virtualrig.stepper.run`.
    Raises RuntimeError where a step of the chambers does not converge.
    """
    chambers, ports = pump_tables(pump, density)
    rows = np.array(ripple, dtype=float).reshape(-1, 3)
    flow, newton = _march(chambers, ports, 2 * np.pi * speed_rpm / 60, rows, pressure)
    if newton > MOST_NEWTON_STEPS:
        raise RuntimeError("the pump's chambers did not converge")
    return flow


def outlet_compliance(pump: Pump, density: float, pressure: float) -> float:
    """Compliance, m3/Pa, of the chambers open to the outlet, on the average over a revolution.

    A flow into a constant `pressure` (Pa) leaves it out; against a line it is a volume at the
    pump.
    """
    chambers, ports = pump_tables(pump, density)
    slope, total = compression(pressure, ports)[1], 0.0
    for turn in 2 * np.pi * np.arange(_ANGLES) / _ANGLES:
        stations = np.zeros((len(chambers), 4))
        chamber_kinematics(turn, 0.0, chambers, ports, stations)
        is_open = stations[:, 2] > 0.0
        total += float(np.sum(slope / stations[is_open, 0]))
    return total / _ANGLES


@njit(cache=True)
def _march(chambers, ports, speed, ripple, pressure):
    """BDF4 over a few revolutions; flow of the last and the greatest number of Newton steps."""
    n = len(chambers)
    dt = 2 * np.pi / speed / SAMPLES
    lead = 25 / 12 / dt
    past = np.full((4, n), compression(pressure, ports)[0])
    x = np.full(n + 1, pressure)
    stations, matrix = np.zeros((n, 4)), np.zeros((n + 1, n + 2))
    history = np.zeros(n)
    flow = np.zeros(SAMPLES)
    most = 0
    for step in range(1, SAMPLES * _REVOLUTIONS + 1):
        turn = 2 * np.pi * step / SAMPLES
        angle, rate = turn, 1.0
        for order, amplitude, shift in ripple:
            angle += amplitude / order * np.sin(order * turn + shift)
            rate += amplitude * np.cos(order * turn + shift)
        chamber_kinematics(angle, speed * rate, chambers, ports, stations)
        for i in range(n):
            history[i] = (
                4 * past[0, i] - 3 * past[1, i] + 4 / 3 * past[2, i] - past[3, i] / 4
            ) / dt
            if ports[AIR] == 0:
                x[i] = 2 * past[0, i] - past[1, i]
        x[n] = pressure
        used = step_chambers(
            stations,
            history,
            lead,
            chambers,
            ports,
            _OUTLET_CONDUCTANCE,
            _OUTLET_CONDUCTANCE * pressure,
            x,
            matrix,
        )
        most = max(most, used)
        delivered = 0.0
        for i in range(n):
            past[3, i], past[2, i], past[1, i] = past[2, i], past[1, i], past[0, i]
            past[0, i] = compression(x[i], ports)[0]
            delivered += stations[i, 2] * orifice_flow(x[i] - pressure, ports[LAMINAR])[0]
        flow[step % SAMPLES] = delivered
    return flow, most
