"""What changes in the flow ripple where two numbers are not those of the data sheet.

A chamber that opens to delivery takes in a backflow until it is compressed. How much of it there is
goes with the bulk modulus of what the chamber holds, which air and heat lower by some per cent, and
when and how suddenly with the angle at which the port plate stands to the swash plate, which play
and the mount decide (Edge & Darling 1989, J. Dyn. Sys. Meas. Control 111, 307; Ivantysyn &
Ivantysynova 2001, Hydrostatic Pumps and Motors, ch. 2). No drawing has either to a per cent, and
both are the same at all operating points.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from rippletwin.case.model import Fluid
from rippletwin.harmonics import peak_amplitudes
from rippletwin.pump.outlets import ConstantPressure
from rippletwin.pump.simulation import PumpRipple, simulate

KEYS = {"bulk_modulus": "bulk_modulus", "port_timing": "port_timing_deg"}
"""Names of the uncertain numbers, and the keys of `Geometry` that hold them."""

STEPS = 6144  # a revolution: runs are compared, and their errors are alike


@dataclass(frozen=True)
class RippleChange:
    """The parabola through three ripples: a number as the sheet has it, and one standard deviation
    above and below.

    turn   angle, rad, by which the shaft is turned ahead above and back below: the shaft angle is
           unknown anyway, and without its part the parabola holds further
    """

    above: PumpRipple
    sheet: PumpRipple
    below: PumpRipple
    turn: float

    def harmonics(self, orders: np.ndarray, mean_flow: float) -> np.ndarray:
        """Slope and curvature (2, F), m3/s peak, at positive shaft `orders` (F,): u standard
        deviations add u and u^2 of them to the ripple of a pump of the mean flow `mean_flow`, m3/s,
        wherever that ripple comes from."""
        orders = np.asarray(orders, int)

        def at(ripple, turn):
            count = len(ripple.flow)
            spectrum = np.append(peak_amplitudes(ripple.flow), 0.0)
            return spectrum[np.minimum(orders, count // 2 + 1)] * np.exp(1j * orders * turn)

        above, sheet, below = (
            at(self.above, self.turn), at(self.sheet, 0.0), at(self.below, -self.turn)
        )  # fmt: skip
        scale = 0.5 * mean_flow / np.mean(self.sheet.flow)
        return scale * np.array([above - below, above + below - 2.0 * sheet])

    def source_admittance(self, s: np.ndarray) -> np.ndarray:
        """What one standard deviation adds to the admittance (F,), m3/s/Pa, beside the flow."""
        return 0.5 * (self.above.source_admittance(s) - self.below.source_admittance(s))


def ripple_change(
    pump: Mapping, fluid: Fluid, speed_rpm: float, pressure: float, name: str, ends: tuple
) -> RippleChange:
    """`RippleChange` of the pump delivering into `pressure` (Pa), its number `name` of KEYS being
    the first and the second of `ends`. Simulations are kept."""

    def run(**changed) -> PumpRipple:
        numbers = {k: v for k, v in {**pump, **changed}.items() if v is not None}
        return _simulated(tuple(sorted(numbers.items())), fluid, float(speed_rpm), float(pressure))

    above, below = (run(**{KEYS[name]: float(end)}) for end in ends)
    turn = 0.5 * np.radians(ends[0] - ends[1]) if name == "port_timing" else 0.0
    return RippleChange(above, run(), below, float(turn))


@cache
def _simulated(pump: tuple, fluid: Fluid, speed_rpm: float, pressure: float) -> PumpRipple:
    return simulate(dict(pump), fluid, speed_rpm, ConstantPressure(pressure), min_steps=STEPS)
