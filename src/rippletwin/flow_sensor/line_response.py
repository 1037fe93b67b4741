"""Response of the line to waves at the pump: sensors' readings, flow and load mismatch."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from rippletwin.case.model import FlowRipple
from rippletwin.line.frequency_domain.line_network import FrequencyDomainLine
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.operating_point import OperatingCondition
from rippletwin.twin.twin import Twin

LineFactory = Callable[[float, np.ndarray], FrequencyDomainLine]
"""(speed_hz, orders (F,)) -> FrequencyDomainLine at s = 2 pi j orders speed_hz, its load linear."""


@dataclass(frozen=True)
class LineResponse:
    """Quantities linear in the waves w = (f, b) at the pump, Pa, at F frequencies.

    p(0) = f + b and q(0) = (f - b)/Zc, Zc the first segment's characteristic impedance (modulus).
    to_sensors (F, S, 2)  sensors' readings, Pa
    to_flow    (F, 2)     the flow wanted, m3/s
    to_load    (F, 2)     b - r f, zero where the waves agree with the load's reflection r; scaled
                          to unit length, Pa
    """

    to_sensors: np.ndarray
    to_flow: np.ndarray
    to_load: np.ndarray


def line_response(line: FrequencyDomainLine, of: str = "source") -> LineResponse:
    """Response of `line`, independent of its source.

    `of` is the flow wanted: that of the ideal "source", or Q(0) at the "outlet", which is less by
    the flow into the source's admittance; ValueError for another.
    The waves are the source's, before the line's `source_impedance` Z: p(0) = p - Z q. Upstream of
    a sensor [p, q](0) = T [p, q](x) with det T = 1, so p(x) = T22 p(0) - T12 q(0).
    """
    zc = np.abs(np.sqrt(line.series[0] / line.shunt[0]))
    size = len(line.s)
    factor = np.broadcast_to(line.sensor_factor, (len(line.sensor_positions), size))
    rows = []
    for x, k in zip(line.sensor_positions, factor):
        # a sensor is on the pump's side of what is inserted where it sits
        before = replace(line, inserts=[insert for insert in line.inserts if insert[0] < x])
        matrix = before.transfer(0.0, x)
        drop = matrix[:, 0, 1] + matrix[:, 1, 1] * line.source_impedance
        from_p, from_q = k * matrix[:, 1, 1], -k * drop / zc
        rows.append(np.stack([from_p + from_q, from_p - from_q], axis=-1))
    own = own_admittance(line, of)
    z = line.input_impedance()
    mismatch = np.stack([zc - z, zc + z], axis=-1)  # times w: (z + zc)(b - r f)
    return LineResponse(
        to_sensors=np.stack(rows, axis=1),
        to_flow=np.stack([1 / zc + own, own - 1 / zc], axis=-1),
        to_load=mismatch / np.linalg.norm(mismatch, axis=-1, keepdims=True),
    )


def own_admittance(line: FrequencyDomainLine, of: str) -> np.ndarray:
    """Admittance (F,) between Q(0) and the flow wanted, see `line_response`."""
    if of not in ("source", "outlet"):
        raise ValueError(f"of must be 'source' or 'outlet', not {of!r}")
    own = line.source_admittance if of == "source" else 0.0
    return np.broadcast_to(own, line.s.shape)


def line_factory(twin: Twin, load_pressure: float, ripple: FlowRipple | None = None) -> LineFactory:
    """Networks of a calibrated twin at one operating point, the load linearised there.

    `load_pressure` in Pa. The mean of `ripple` (m3/s) determines an orifice whose coefficient the
    rig does not give, and the ripple's admittance is the source's. None is that of the lumped pump
    with its fitted numbers.
    """

    def line_at(speed_hz: float, orders: np.ndarray) -> FrequencyDomainLine:
        nonlocal ripple
        if ripple is None:
            from rippletwin.pump.outlets import ConstantPressure
            from rippletwin.pump.simulation import simulate

            outlet = ConstantPressure(load_pressure)
            ripple = simulate(twin.fitted_pump(), twin.rig.fluid, 60 * speed_hz, outlet)
        # A free source has no ripple to balance an orifice with: the load stays linear.
        condition = OperatingCondition.at_orders(
            orders, speed_hz, load_pressure, ripple, source="free"
        )
        line = ForwardModel(twin, [condition]).network(twin.theta)
        line.source_admittance = line.source_admittance + ripple.source_admittance(line.s)
        return line

    return line_at
