"""The steady state of a recording: mean pressure, mean flow and orifice coefficient."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from rippletwin.case.model import FlowRipple, Rig, Sensor
from rippletwin.errors import InputError
from rippletwin.harmonics import flow_harmonics

GUESSED_VELOCITY = 2.0
"""Mean flow velocity, m/s, in the last segment where neither a flow ripple nor an orifice
coefficient is known; oil lines are designed for 0.5 to 6 m/s."""

STATED_PRESSURE_SD = 0.005  # relative, of a load pressure that an operator set and wrote down
SENSOR_MEAN_SD = 0.002  # relative, of a sensor's mean pressure
STUDENT_DEGREES = 3.0
"""Degrees of freedom of the errors of sensors' means: a sensor may be AC-coupled or have a gain
error, which gives the distribution long tails."""

MAX_MEAN_DEVIATION = 0.3  # relative: the mean of a sensor further off is no pressure
MIN_FALL_SD = 0.01  # relative, of the pressure fall along the line
MAX_ITERATIONS, CONVERGED = 30, 1e-12  # of reweighting; relative change of the pressure


@dataclass(frozen=True)
class OperatingCondition:
    """What to predict where nothing was recorded: an `Observation` without data.

    The fields are those of `rippletwin.spectra.observation.Observation`. Without `mean` the load
    pressure is believed as stated; without `sensors` all of the rig's are predicted.
    """

    label: str = ""
    frequency_hz: np.ndarray | Sequence[float] = ()
    orders: np.ndarray | None = None
    speed_hz: float | None = None
    load_pressure: float | None = None
    flow_ripple: FlowRipple | None = None
    kind: str = "periodic"
    source: str = "nominal"
    mean: np.ndarray | None = None
    sensors: tuple[Sensor, ...] | None = None
    normalised: bool = False
    modulation: complex = 0.0

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
    """Load pressure in Pa, flow in m3/s, orifice coefficient in m3/s/sqrt(Pa); NaN where unknown.

    `ripple` is None where the source is free or known by definition (input impedance).
    """

    load_pressure: float
    mean_flow: float
    coefficient: float
    ripple: FlowRipple | None


def operating_point(
    rig: Rig, observation, ripple: FlowRipple | None, guessed_load: bool = False
) -> OperatingPoint:
    """Operating point of an observation with the flow ripple `ripple` in the data sheet's line.

    An orifice's coefficient is the data sheet's, else it follows from mean flow and load pressure;
    with `guessed_load` from a guess of the mean flow, whatever flow is given.
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
    elif np.isfinite(flow) and not guessed_load:
        coefficient = flow / root
    else:
        coefficient = guessed_flow(rig) / root
    return OperatingPoint(mean, coefficient * root, coefficient, ripple)


def guessed_flow(rig: Rig) -> float:
    """Mean flow, m3/s, where nothing tells it."""
    return GUESSED_VELOCITY * rig.line[-1].area


def _load_pressure(rig: Rig, observation, flow: float) -> float | None:
    """Mean pressure before the load, Pa: as stated, corrected by the sensors' means."""
    stated = observation.load_pressure
    means = np.zeros(0) if observation.mean is None else np.atleast_1d(observation.mean)
    sensors = observation.sensors or rig.sensors
    if stated is None:
        if not len(means):
            return None
        positions = [sensor.position for sensor in sensors[: len(means)]]
        nearest = np.argmax(positions) if positions else -1  # an impedance is of no sensor
        return float(means[nearest])
    # the sensors of spectra and impedances have no means
    if observation.kind not in ("periodic", "random") or not len(means) or not stated > 0.0:
        return stated
    fall = np.array([pressure_fall(rig, sensor.position, flow) for sensor in sensors]) / stated
    if len(fall) != len(means):
        return stated
    used = np.abs(means / stated - 1.0 - fall) < MAX_MEAN_DEVIATION
    sheet = rig.uncertainty
    fall_sd = max(np.hypot(sheet.viscosity, 4.0 * sheet.diameter), MIN_FALL_SD)
    relative = _estimate_pressure(tuple(means[used] / stated), tuple(fall[used]), fall_sd)
    return float(stated * relative)


@lru_cache(maxsize=1024)
def _estimate_pressure(means: tuple[float, ...], falls: tuple[float, ...], fall_sd: float) -> float:
    """Mean pressure before the load, from those of sensors and the calculated falls of pressure to
    them, all over the stated pressure before the load; cached, since every model of a fit asks.

    Unknowns are the pressure and a factor on its calculated fall along the line. They are estimated
    by iteratively reweighted least squares with Student's distribution for the sensors. The effort
    pays: the compressibility of air goes with the pressure to the power -1.8 and an orifice's
    resistance with the pressure, so that 0.3 % of pressure make 0.5 % of ripple.
    """
    # Rows: prior of the pressure, prior of the factor, one for each sensor.
    rows = np.vstack([np.eye(2), np.column_stack([np.ones(len(falls)), falls])])
    values = np.concatenate([[1.0, 1.0], means])
    sds = np.concatenate([[STATED_PRESSURE_SD, fall_sd], np.full(len(falls), SENSOR_MEAN_SD)])
    weight, estimate = 1.0 / sds**2, np.ones(2)
    for _ in range(MAX_ITERATIONS):
        off = (rows[2:] @ estimate - values[2:]) / sds[2:]
        weight[2:] = (STUDENT_DEGREES + 1.0) / (STUDENT_DEGREES + off**2) / sds[2:] ** 2
        weighted, before = rows.T * weight, estimate
        estimate = np.linalg.solve(weighted @ rows, weighted @ values)
        if np.max(np.abs(estimate - before)) < CONVERGED:
            break
    return float(estimate[0])


def pressure_fall(rig: Rig, position: float, flow: float) -> float:
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
