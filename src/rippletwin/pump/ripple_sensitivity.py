"""Second-order sensitivity of the flow ripple to numbers of the pump.

A chamber that opens to delivery takes in a backflow until it is compressed. Its amount depends on
the bulk modulus of the liquid in the chamber, which air and heat lower by some per cent. Its onset
depends on the angle between port plate and swash plate, hence on play and mounting (Edge & Darling
1989, J. Dyn. Sys. Meas. Control 111, 307; Ivantysyn & Ivantysynova 2001, Hydrostatic Pumps and
Motors, ch. 2). How fast the port opens and how the chambers fill follow from relief grooves, edges
and free air. No drawing gives these to a per cent; all are the same at all operating points.
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

KEYS = {
    "bulk_modulus": "bulk_modulus",
    "port_timing": "port_timing_deg",
    "dead_volume": "dead_volume",
    "discharge_coefficient": "discharge_coefficient",
    "port_opening": "port_opening_deg",
    "port_overlap": "port_overlap_deg",
    "air_fraction": "air_fraction",
    "case_leakage": "case_leakage",
}
"""Names of the uncertain parameters -> keys of `Geometry`."""

STEPS_PER_REVOLUTION = 6144  # enough for differences between runs, whose errors are alike


@dataclass(frozen=True)
class RippleChange:
    """The parabola through three ripples: a parameter at its nominal value, and one standard
    deviation above and below.

    turn   rad, by which the shaft angle of the ripple above is advanced and that below retarded:
           the shaft angle is unknown anyway, and without its change the parabola fits further
    """

    above: PumpRipple
    nominal: PumpRipple
    below: PumpRipple
    turn: float

    def harmonics(self, orders: np.ndarray, mean_flow: float) -> np.ndarray:
        """Slope and curvature (2, F), m3/s peak, at positive shaft `orders` (F,): a parameter at
        coordinate u adds u times the slope and u^2 times the curvature to a ripple of mean flow
        `mean_flow`, m3/s, whatever its origin."""
        orders = np.asarray(orders, int)

        def at(ripple, turn):
            count = len(ripple.flow)
            spectrum = np.append(peak_amplitudes(ripple.flow), 0.0)
            return spectrum[np.minimum(orders, count // 2 + 1)] * np.exp(1j * orders * turn)

        above, nominal, below = (
            at(self.above, self.turn), at(self.nominal, 0.0), at(self.below, -self.turn)
        )  # fmt: skip
        scale = 0.5 * mean_flow / np.mean(self.nominal.flow)
        return scale * np.array([above - below, above + below - 2.0 * nominal])

    def source_admittance(self, s: np.ndarray) -> np.ndarray:
        """Change of the source admittance (F,), m3/(Pa s), by one standard deviation."""
        return 0.5 * (self.above.source_admittance(s) - self.below.source_admittance(s))


def ripple_change(
    pump: Mapping, fluid: Fluid, speed_rpm: float, pressure: float, name: str, ends: tuple
) -> RippleChange:
    """`RippleChange` of a pump that delivers into `pressure` (Pa), with the values `ends` of its
    parameter `name` of KEYS above and below. Simulations are cached."""

    def run(**changed) -> PumpRipple:
        numbers = {k: v for k, v in {**pump, **changed}.items() if v is not None}
        return _simulate_cached(
            tuple(sorted(numbers.items())), fluid, float(speed_rpm), float(pressure)
        )

    above, below = (run(**{KEYS[name]: float(end)}) for end in ends)
    turn = 0.5 * np.radians(ends[0] - ends[1]) if name == "port_timing" else 0.0
    return RippleChange(above, run(), below, float(turn))


@cache
def _simulate_cached(pump: tuple, fluid: Fluid, speed_rpm: float, pressure: float) -> PumpRipple:
    return simulate(
        dict(pump), fluid, speed_rpm, ConstantPressure(pressure), min_steps=STEPS_PER_REVOLUTION
    )
