"""The flow of pumps about the fitted one, whose uncertain numbers are drawn.

To first order: a standard deviation of a number moves the healthy ripple by 6 to 26 % and a leak's
change by 1 to 7 %, and the second order is a few times smaller. So a thousand pumps cost no more
simulations than `simulate_leak_flow` has made.

Flow is told as the port plate stands (`plate_turns`).
"""

from __future__ import annotations

import numpy as np

from rippletwin.case.model import Fluid
from rippletwin.diagnosis.anchor import even_flow
from rippletwin.diagnosis.pump_flow import (
    NUMBERS,
    TIMING_SD_DEG,
    UNCERTAIN,
    LeakFlow,
    moved_pumps,
    plate_turns,
    simulate_healthy_pump,
)
from rippletwin.pump.ripple_sensitivity import KEYS
from rippletwin.twin.twin import Twin

FITTED_AS = KEYS | {"discharge_coefficient": "port_area"}
"""Parameter of a twin -> the number that it is here: a fitted discharge coefficient is that of the
ports, and the leak's is part of its area's severity."""
SDS = dict(zip(NUMBERS, (*UNCERTAIN.values(), TIMING_SD_DEG), strict=True))


class UncertainPump:
    """A pump at r/min into a pressure, Pa, whose flow is asked for at shaft orders (F,) from 1.

    Numbers z (U,) are those of `NUMBERS`, in their standard deviations from the pump's. Raises
    ArithmeticError where the chamber equations of one of the pumps cannot be solved.
    """

    def __init__(
        self, pump: dict, fluid: Fluid, speed_rpm: float, pressure: float, orders: np.ndarray
    ):
        self._orders = orders
        self._healthy, *moved = (
            even_flow(
                simulate_healthy_pump(each, fluid, speed_rpm, pressure), orders, pump["pistons"]
            )
            for each in (pump, *moved_pumps(pump))
        )
        self._slopes = plate_turns(orders) * np.array(moved) - self._healthy

    def healthy(self, z: np.ndarray) -> np.ndarray:
        """Flow (F,) of the healthy pump, m3/s."""
        return self._healthy + z @ self._slopes

    def change(self, leak: LeakFlow, area: float, z: np.ndarray) -> np.ndarray:
        """Change (F,) of the flow by a leak of `area`, m2, at piston 0, m3/s."""
        return (leak.harmonics(area) + z @ leak.pump_slopes(area))[self._orders]


def number_slopes(twin: Twin) -> np.ndarray:
    """Derivatives (U, P) of the pump's numbers, in standard deviations, by the coordinates of a
    twin; a number that is none of its parameters has zeros."""
    slopes = np.zeros((len(NUMBERS), len(twin.parameters)))
    for k, parameter in enumerate(twin.parameters):
        number = FITTED_AS[parameter.name] if parameter.place == "pump" else None
        if number in NUMBERS:
            slopes[NUMBERS.index(number), k] = parameter.prior.scale / SDS[number]
    return slopes
