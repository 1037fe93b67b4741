"""A twin's line at one operating point as a state space, for other programs."""

from __future__ import annotations

import numpy as np

from rippletwin.line.time_domain.state_space import StateSpace, fit_state_space
from rippletwin.twin.flow_source import pump_changes
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.operating_point import OperatingCondition
from rippletwin.twin.twin import Twin

FREQUENCIES = 1500  # at least, evenly over the band
POINTS_PER_MODE = 24  # between neighbouring resonances of the line


def line_response(twin: Twin, condition, frequency_hz: np.ndarray) -> np.ndarray:
    """Pressure (1 + S, F), Pa, at the pump and as the sensors read it, for a flow ripple of 1 m3/s
    at `frequency_hz` (F,) that is so small that load and line are linear. The pump's own passage,
    as far as the twin has one, is behind the first of them.

    condition : an observation, or an `OperatingCondition` with the mean pressure and, of a pump,
        the speed. The flow is that of the ideal source; the compliance of the pump's chambers
        beside it, as far as the twin has it, is part of the line.
    """
    ripple = twin.operating_point(condition).ripple
    small = OperatingCondition(
        label=condition.label,
        frequency_hz=frequency_hz,
        orders=np.zeros(len(frequency_hz)),  # in the shaft's frame
        speed_hz=condition.speed_hz,
        load_pressure=condition.load_pressure,
        flow_ripple=ripple or condition.flow_ripple,
        kind="spectrum",
        source="free",
        mean=condition.mean,
    )
    line = ForwardModel(twin, [small]).network(twin.theta)
    line.source_flow = 1.0
    if ripple is not None:
        chambers = ripple.source_admittance(line.s)
        if np.any(chambers):  # a ripple that is given is an ideal source
            for k, change in pump_changes(
                twin, condition.speed_hz, condition.load_pressure, ripple
            ):
                moved = twin.theta[k] - change.centre
                chambers = chambers + moved * change.source_admittance(line.s)
        line.source_admittance = line.source_admittance + chambers
    return np.vstack([line.pump_pressure(), line.readings()])


def twin_state_space(twin: Twin, condition, lowest_hz: float, highest_hz: float) -> StateSpace:
    """`StateSpace` from the pump's flow ripple, m3/s, to the pressure ripples, Pa, at the pump
    outlet and as the sensors read it, fitted between two frequencies, Hz."""
    arrays = twin.arrays(twin.theta)
    spacing = 0.5 / np.sum(arrays.lengths / arrays.wave_speeds)  # of the resonances
    count = max(FREQUENCIES, int(POINTS_PER_MODE * highest_hz / spacing))
    frequency = np.linspace(lowest_hz, highest_hz, count)
    return fit_state_space(2j * np.pi * frequency, line_response(twin, condition, frequency))
