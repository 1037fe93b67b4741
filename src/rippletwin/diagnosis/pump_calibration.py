"""The pump's numbers from the flow that healthy recordings ask for.

Through a line that is known (`line_calibration`) the sensors tell the healthy pump's flow at every
order of the pistons. A data sheet's ports open too fast, and its oil holds too little air: the flow
tells, and with it how a leak's pulse begins and ends. The lumped pump is fitted to it by least
squares, its numbers about those of the data sheet (maximum a posteriori).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares

from rippletwin.case.model import Fluid
from rippletwin.diagnosis.anchor import estimate_flow_at_pump, even_flow, find_alignment
from rippletwin.diagnosis.drifting_line import DriftingLine
from rippletwin.diagnosis.pump_flow import (
    TIMING_SD_DEG,
    load_pressure_of,
    rebuild,
    simulate_healthy_pump,
    with_fitted_pump,
)
from rippletwin.pump.geometry import Geometry, stated_numbers
from rippletwin.twin.twin import Twin

PRIOR_SD = {
    "bulk_modulus": 0.08,
    "dead_volume": 0.15,
    "port_area": 0.17,  # and with it the ports' discharge coefficient
    "port_opening_deg": 0.5,
    "port_overlap_deg": 0.5,
    "air_fraction": 2.0,
}
"""Standard deviations of logarithms about the data sheet: relief grooves lengthen an opening, and
free air is between 0.1 and 1 % (Gholizadeh, Burton and Schoenau 2011)."""
SCALE_SD = 0.05  # of the flow's logarithm: ratios between sensors leave the line's impedance open
HIGHEST_HZ = 2500.0  # up to which the flow is fitted
RELATIVE_ERROR, LEAST_ERROR = 0.1, 0.03  # of the flow at an order, and over the flow's rms
MOST_SDS = 4.0  # from the data sheet
MOST_OVERLAP_DEG = 90.0  # so that ports are open for half of the time that they could be
EVALUATIONS = 8
ROUNDS = 2
ALIGNMENT_ROUNDS = 3
IMPOSSIBLE = 1e3  # residual of a pump that cannot be simulated
POINT_DIGITS = 2  # of speed and pressure that make an operating point


@dataclass(frozen=True)
class _Flow:
    """Measured healthy flow (F,) at the pistons' orders (F,), m3/s, with its errors (F,); r/min and
    load pressure, Pa, of the recording."""

    speed_rpm: float
    pressure: float
    orders: np.ndarray
    values: np.ndarray
    error: np.ndarray


class RecalibratedTwin(NamedTuple):
    """A twin, and what one more step of its pump's fit promises to add to the log posterior (as in
    `laplace.Mode`); 0 where the pump was not fitted."""

    twin: Twin
    expected_gain: float = 0.0


def calibrate_pump(twin: Twin, healthy: Sequence, sheet: Mapping) -> RecalibratedTwin:
    """The twin with its pump fitted to the flow of healthy periodic observations, about the pump of
    the data sheet. What the twin's own pump was fitted to does not count: effects and errors of the
    line may have made up for it.

    The line must be known; the pump's numbers are no parameters (`with_fitted_pump`). The twin is
    returned with its own pump where the data sheet has no geometry, and where no band has an order
    of the pistons that tells.
    """
    fitted, gain = with_fitted_pump(twin), 0.0
    pump = stated_numbers(sheet)
    healthy = [o for o in healthy if np.any(_told_orders(o, pump["pistons"]))]
    if set(pump) == {"pistons"} or not healthy:
        return RecalibratedTwin(fitted)
    for _ in range(ROUNDS):  # the flow is told beside the chambers of the pump that was fitted
        flows = [_measured_flow(fitted, observation) for observation in healthy]
        numbers, gain = _fit_numbers(pump, fitted.rig.fluid, flows)
        fitted = rebuild(fitted, replace(fitted.rig, pump=pump | numbers), theta=fitted.theta)
    return RecalibratedTwin(fitted, gain)


def _fit_numbers(pump: dict, fluid: Fluid, flows: Sequence[_Flow]) -> tuple[dict, float]:
    """The numbers that come nearest to the flows, about those of `pump`, and the gain that one more
    step promises."""

    def residuals(x: np.ndarray) -> np.ndarray:
        numbers, scale = pump | _numbers(pump, x), np.exp(SCALE_SD * x[-1])
        try:
            left = [_residual(numbers, fluid, flow, scale) for flow in flows]
        except ArithmeticError:  # no such pump can be simulated: the step is taken back
            left = [np.full(2 * len(flow.values), IMPOSSIBLE) for flow in flows]
        return np.concatenate([*left, x])

    start = np.zeros(len(PRIOR_SD) + 2)
    ends = -MOST_SDS, MOST_SDS
    found = least_squares(residuals, start, bounds=ends, max_nfev=EVALUATIONS)
    slopes = found.jac[:, found.active_mask == 0]  # a number at its end goes no further
    gradient = slopes.T @ found.fun
    gain = 0.5 * float(gradient @ np.linalg.solve(slopes.T @ slopes, gradient))
    return _numbers(pump, found.x), gain


def one_each_point(observations: Sequence) -> list:
    """The first of the observations of each operating point, to POINT_DIGITS."""
    first: dict[tuple[str, ...], Any] = {}
    for o in observations:
        point = tuple(f"{x or 0.0:.{POINT_DIGITS}g}" for x in (o.speed_hz, o.load_pressure))
        first.setdefault(point, o)
    return list(first.values())


def _measured_flow(twin: Twin, observation) -> _Flow:
    speed_rpm, pressure = 60.0 * observation.speed_hz, load_pressure_of(twin, observation)
    ripple = simulate_healthy_pump(twin.rig.pump, twin.rig.fluid, speed_rpm, pressure)
    response = DriftingLine(twin, observation, ripple).response()
    flow, _ = estimate_flow_at_pump(response, observation.values)
    orders = np.asarray(observation.orders)
    used = _told_orders(observation, twin.rig.pump["pistons"])
    flow = flow[used]
    least = LEAST_ERROR * np.sqrt(np.mean(np.abs(flow) ** 2))
    error = np.hypot(RELATIVE_ERROR * np.abs(flow), least)
    return _Flow(speed_rpm, pressure, orders[used], flow, error)


def _told_orders(observation, pistons: int) -> np.ndarray:
    """Which orders (F,) of an observation tell the pump: the pistons' in its band, up to
    HIGHEST_HZ."""
    frequency_hz = observation.frequency_hz
    inside = (observation.min_frequency_hz <= frequency_hz) & (frequency_hz <= HIGHEST_HZ)
    return inside & (np.asarray(observation.orders) % pistons == 0)


def _residual(numbers: dict, fluid, flow: _Flow, scale: float) -> np.ndarray:
    """Real residuals (2 F,) over their errors, at the best shaft angle."""
    pistons, orders = numbers["pistons"], flow.orders
    ripple = simulate_healthy_pump(numbers, fluid, flow.speed_rpm, flow.pressure)
    simulated = scale * even_flow(ripple, orders, pistons)
    angle = find_alignment(simulated[None], flow.values[None], orders, 2 * np.pi / pistons)
    for _ in range(ALIGNMENT_ROUNDS):  # the grid of angles is too coarse for differences
        turned = simulated * np.exp(1j * orders * angle)
        slope, left = 1j * orders * turned / flow.error, (flow.values - turned) / flow.error
        angle += np.sum((np.conj(slope) * left).real) / np.sum(np.abs(slope) ** 2)
    left = (flow.values - simulated * np.exp(1j * orders * angle)) / flow.error
    return np.concatenate([left.real, left.imag])


def _numbers(pump: dict, x: np.ndarray) -> dict:
    """The pump's numbers at coordinates x in prior standard deviations, the timing's after those of
    `PRIOR_SD`."""
    sheet = Geometry.from_dict(pump)
    found = {
        name: getattr(sheet, name) * float(np.exp(sd * u))
        for (name, sd), u in zip(PRIOR_SD.items(), x)
    }
    overlap = np.clip(found["port_overlap_deg"], -MOST_OVERLAP_DEG, MOST_OVERLAP_DEG)
    found["port_overlap_deg"] = float(overlap)
    return found | {
        "port_timing_deg": sheet.port_timing_deg + TIMING_SD_DEG * float(x[len(PRIOR_SD)])
    }
