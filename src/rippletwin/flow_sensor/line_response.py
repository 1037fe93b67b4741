"""The line as the flow sensors need it: what p and q at the pump mean at the sensors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rippletwin.case.model import FlowRipple
from rippletwin.line.frequency_domain.line_network import FrequencyDomainLine
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.operating_point import OperatingCondition

NetworkFactory = Callable[[float, np.ndarray], FrequencyDomainLine]
"""(speed_hz, orders (F,)) -> FrequencyDomainLine at s = 2 pi j orders speed_hz, its load linear."""


@dataclass(frozen=True)
class LineResponse:
    """The waves w = (f, b) at the pump, in Pa, and what is linear in them, at F frequencies.

    p(0) = f + b and q(0) = (f - b)/Zc, Zc the first segment's characteristic impedance (modulus).
    to_sensors (F, S, 2)  sensors' readings, Pa
    to_flow    (F, 2)     the flow wanted, m3/s
    to_load    (F, 2)     b - r f, zero where the waves agree with the load's reflection r; scaled
                          to unit length, Pa
    """

    to_sensors: np.ndarray
    to_flow: np.ndarray
    to_load: np.ndarray


def line_response(network: FrequencyDomainLine, of: str = "source") -> LineResponse:
    """What `network`'s line does with a state at the pump, whatever source and load are.

    `of` is the flow wanted: the ideal "source"'s, or the "outlet"'s Q(0), which lacks what the
    source's own admittance takes; ValueError for another.
    Upstream of a sensor [p, q](0) = T [p, q](x) with det T = 1, so p(x) = T22 p(0) - T12 q(0).
    """
    zc = np.abs(np.sqrt(network.series[0] / network.shunt[0]))
    size = len(network.s)
    factor = np.broadcast_to(network.sensor_factor, (len(network.sensor_positions), size))
    rows = []
    for x, k in zip(network.sensor_positions, factor):
        matrix = network.transfer(0.0, x)
        from_p, from_q = k * matrix[:, 1, 1], -k * matrix[:, 0, 1] / zc
        rows.append(np.stack([from_p + from_q, from_p - from_q], axis=-1))
    own = own_admittance(network, of)
    z = network.input_impedance()
    mismatch = np.stack([zc - z, zc + z], axis=-1)  # times w: (z + zc)(b - r f)
    return LineResponse(
        to_sensors=np.stack(rows, axis=1),
        to_flow=np.stack([1 / zc + own, own - 1 / zc], axis=-1),
        to_load=mismatch / np.linalg.norm(mismatch, axis=-1, keepdims=True),
    )


def own_admittance(network: FrequencyDomainLine, of: str) -> np.ndarray:
    """Admittance (F,) between Q(0) and the flow wanted, see `line_response`."""
    if of not in ("source", "outlet"):
        raise ValueError(f"of must be 'source' or 'outlet', not {of!r}")
    own = network.source_admittance if of == "source" else 0.0
    return np.broadcast_to(own, network.s.shape)


def network_of(twin, load_pressure: float, ripple: FlowRipple | None = None) -> NetworkFactory:
    """Networks of a calibrated twin at one operating point, the load linearised there.

    `load_pressure` in Pa; the mean of `ripple` (m3/s) sets an orifice whose coefficient the rig
    does not give, and what admittance the ripple has is the source's. None takes the lumped pump.
    """

    def network(speed_hz: float, orders: np.ndarray) -> FrequencyDomainLine:
        nonlocal ripple
        if ripple is None:
            from rippletwin.pump.outlets import ConstantPressure
            from rippletwin.pump.simulation import simulate

            outlet = ConstantPressure(load_pressure)
            ripple = simulate(twin.rig.pump, twin.rig.fluid, 60 * speed_hz, outlet)
        # A free source has no ripple to balance an orifice with: the load stays linear.
        condition = OperatingCondition.at_orders(
            orders, speed_hz, load_pressure, ripple, source="free"
        )
        line = ForwardModel(twin, [condition]).network(twin.theta)
        line.source_admittance = line.source_admittance + ripple.source_admittance(line.s)
        return line

    return network
