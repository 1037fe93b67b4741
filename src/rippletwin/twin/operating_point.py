"""The steady state about which the ripple goes: mean pressure, mean flow, orifice coefficient."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rippletwin.case.model import FlowRipple, Rig, Sensor
from rippletwin.errors import InputError
from rippletwin.harmonics import flow_harmonics

GUESSED_VELOCITY = 2.0
"""Mean flow velocity (m/s) in the last segment where neither a flow ripple nor an orifice
coefficient is known: oil lines run at half to six metres a second."""

SET_SD = 0.005
"""Relative standard deviation of a load pressure that an operator set and wrote down."""

MEAN_SD = 0.002
"""The same of a sensor's mean pressure. Its errors have long tails: a sensor may be coupled without
its mean, or have a gain of its own."""

COUPLED = 0.3  # relative: a mean further off than this is no pressure
DEGREES = 3.0  # of freedom of Student's distribution, which has such tails
ROUNDS, SETTLED = 30, 1e-12


@dataclass(frozen=True)
class OperatingCondition:
    """What to predict where nothing was recorded: an `Observation` without data.

    The fields are those of `rippletwin.spectra.observation.Observation`. Without `mean` the load
    pressure is believed as stated; without `sensors` all of the rig's are predicted.
    """

    label: str = ""
    frequency_hz: np.ndarray = ()
    orders: np.ndarray | None = None
    speed_hz: float | None = None
    load_pressure: float | None = None
    flow_ripple: FlowRipple | None = None
    kind: str = "periodic"
    source: str = "nominal"
    mean: np.ndarray | None = None
    sensors: tuple[Sensor, ...] | None = None
    normalised: bool = False

    @classmethod
    def at_orders(
        cls,
        orders: np.ndarray,
        speed_hz: float,
        load_pressure: float,
        flow_ripple: FlowRipple,
        source: str = "nominal",
    ) -> OperatingCondition:
        """Shaft `orders` (F,) at rev/s, Pa before the load and the flow ripple of the pump."""
        orders = np.asarray(orders)
        return cls(
            frequency_hz=orders * speed_hz,
            orders=orders,
            speed_hz=speed_hz,
            load_pressure=load_pressure,
            flow_ripple=flow_ripple,
            source=source,
        )


class OperatingPoint(NamedTuple):
    """Pressures in Pa, flow in m3/s, orifice coefficient in m3/s/sqrt(Pa); NaN where unknown.

    `ripple` is None where the source is free or known by definition (input impedance).
    """

    load_pressure: float
    mean_flow: float
    coefficient: float
    ripple: FlowRipple | None


def operating_point(rig: Rig, observation, ripple: FlowRipple | None) -> OperatingPoint:
    """That of an observation whose source is `ripple`, with the data sheet's line.

    The coefficient is that of the data sheet, or what mean flow and load pressure give.
    Raises InputError for an orifice load without a mean pressure.
    """
    load = rig.load
    given = ripple or observation.flow_ripple
    flow = np.nan if given is None else float(flow_harmonics(given, np.zeros(1))[0].real)
    mean = _load_pressure(rig, observation, flow)
    if load.kind != "orifice":
        known = np.nan if ripple is None else flow
        return OperatingPoint(np.nan if mean is None else mean, known, np.nan, ripple)
    if mean is None or not mean > load.back_pressure:
        raise InputError(
            observation.label,
            "load_pressure",
            f"an orifice load needs a mean pressure above the back pressure, not {mean}",
            "give load_pressure in Pa for this recording, or another kind of load",
        )
    root = np.sqrt(mean - load.back_pressure)
    if load.coefficient is not None:
        coefficient = load.coefficient
    elif np.isfinite(flow):
        coefficient = flow / root
    else:
        coefficient = GUESSED_VELOCITY * rig.line[-1].area / root
    return OperatingPoint(mean, coefficient * root, coefficient, ripple)


def _load_pressure(rig: Rig, observation, flow: float) -> float | None:
    """Mean pressure before the load, as the recording's stated one and the sensors' means have it.

    What entrained air holds goes with the pressure to the power -1.7, and an orifice's resistance
    with the pressure itself: a stated pressure that is 0.3 % off leaves half a per cent of ripple.
    """
    stated = observation.load_pressure
    means = np.zeros(0) if observation.mean is None else np.atleast_1d(observation.mean)
    if stated is None:
        return float(means[-1]) if len(means) else None
    if observation.kind == "input_impedance" or not len(means) or not stated > 0.0:
        return stated
    sensors = observation.sensors or rig.sensors
    fall = np.array([_fall(rig, sensor.position, flow) for sensor in sensors]) / stated
    if len(fall) != len(means):
        return stated
    told = np.abs(means / stated - 1.0) < COUPLED
    fall, means = fall[told], means[told]
    # Of the unknowns (pressure, share of the fall) those two and the sensors each say something.
    sheet = rig.uncertainty
    known = np.hypot(sheet.viscosity, 4.0 * sheet.diameter)
    rows = np.vstack([np.eye(2), np.column_stack([np.ones_like(fall), fall])])
    values = np.concatenate([[1.0, 1.0], means / stated])
    sds = np.concatenate([[SET_SD, max(known, 0.01)], np.full(len(fall), MEAN_SD)])
    weight, answer = 1.0 / sds**2, np.ones(2)
    for _ in range(ROUNDS):
        off = (rows[2:] @ answer - values[2:]) / sds[2:]
        weight[2:] = (DEGREES + 1.0) / (DEGREES + off**2) / sds[2:] ** 2
        weighted, before = rows.T * weight, answer
        answer = np.linalg.solve(weighted @ rows, weighted @ values)
        if np.max(np.abs(answer - before)) < SETTLED:
            break
    return float(stated * answer[0])


def _fall(rig: Rig, position: float, flow: float) -> float:
    """Pressure, Pa, that `flow` loses between a position and the load (Hagen-Poiseuille; Blasius
    1913 where it is turbulent)."""
    flow = GUESSED_VELOCITY * rig.line[-1].area if not np.isfinite(flow) else flow
    if rig.load.kind == "closed":
        return 0.0
    start = lost = 0.0
    for segment in rig.line:
        end = start + segment.length
        length = max(end - max(position, start), 0.0)
        velocity = flow / segment.area
        reynolds = abs(velocity) * segment.diameter / rig.fluid.kinematic_viscosity
        factor = 64.0 / max(reynolds, 1e-9) if reynolds < 2300.0 else 0.316 / reynolds**0.25
        lost += factor * length / segment.diameter * 0.5 * rig.fluid.density * velocity**2
        start = end
    return lost
