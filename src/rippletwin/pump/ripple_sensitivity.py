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
from functools import lru_cache

import numpy as np

from rippletwin.case.model import Fluid
from rippletwin.harmonics import peak_amplitudes
from rippletwin.pump.geometry import stated_numbers
from rippletwin.pump.outlets import ConstantPressure, PressureWave
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

CACHED = 512  # simulations: seventeen an operating point, of some 0.3 MB
STEPS_PER_REVOLUTION = 6144  # enough for differences between runs, whose errors are alike
STEPS_AGAINST_WAVE = 3072  # no chamber stands for others then, and only changes near by matter


@dataclass(frozen=True)
class RippleChange:
    """The parabola through three ripples: a parameter at the value of a pump, and one standard
    deviation above and below.

    turns    rad, by which the shaft angles of the ripples are advanced, above, there and below:
             the shaft angle is unknown anyway, and without its change the parabola fits further
    centre   coordinate of the value there; 0 is the data sheet's
    speed_hz of the shaft, rev/s
    """

    above: PumpRipple
    there: PumpRipple
    below: PumpRipple
    turns: tuple[float, float, float]
    centre: float
    speed_hz: float

    def harmonics(self, orders: np.ndarray, mean_flow: float) -> np.ndarray:
        """What coordinates 1, u and u^2 are multiplied with, (3, F), m3/s peak, at positive shaft
        `orders` (F,): together they are added to a ripple of mean flow `mean_flow`, m3/s, whatever
        its origin, at coordinate u."""
        orders = np.asarray(orders, int)
        above, there, below = (
            self._source(ripple, orders) * np.exp(1j * orders * turn)
            for ripple, turn in zip((self.above, self.there, self.below), self.turns)
        )
        scale = 0.5 * mean_flow / np.mean(self.there.flow)
        slope, curvature = above - below, above + below - 2.0 * there
        c = self.centre
        return scale * np.array(
            [(c * curvature - slope) * c, slope - 2.0 * c * curvature, curvature]
        )

    def _source(self, ripple: PumpRipple, orders: np.ndarray) -> np.ndarray:
        """Flow (F,), m3/s peak, into a constant pressure, which with the admittance of the chambers
        delivers what `ripple` does at its outlet's pressure."""

        def at_orders(period):
            spectrum = np.append(peak_amplitudes(period), 0.0)
            return spectrum[np.minimum(orders, len(period) // 2 + 1)]

        flow = at_orders(ripple.flow)
        if ripple.meets_ripple:
            s = 2j * np.pi * self.speed_hz * orders
            flow = flow + ripple.source_admittance(s) * at_orders(ripple.outlet_pressure)
        return flow

    def source_admittance(self, s: np.ndarray) -> np.ndarray:
        """Change of the source admittance (F,), m3/(Pa s), by one standard deviation."""
        return 0.5 * (self.above.source_admittance(s) - self.below.source_admittance(s))


def ripple_change(
    pump: Mapping,
    fluid: Fluid,
    speed_rpm: float,
    pressure: float | np.ndarray,
    name: str,
    ends: tuple,
    centre: float = 0.0,
    advance: float = 0.0,
) -> RippleChange:
    """`RippleChange` of a pump, with the values `ends` of its parameter `name` of KEYS above and
    below its coordinate `centre`.

    pressure   Pa, into which it delivers: a number, or a period (M,) over a revolution
    advance    rad, by which the shaft angle of its own ripple is advanced

    The last simulations are cached.
    """
    outlet = float(pressure) if np.ndim(pressure) == 0 else np.asarray(pressure, float).tobytes()

    def run(**changed) -> PumpRipple:
        numbers = stated_numbers({**pump, **changed})
        return _simulate_cached(tuple(sorted(numbers.items())), fluid, float(speed_rpm), outlet)

    above, below = (run(**{KEYS[name]: float(end)}) for end in ends)
    turn = 0.5 * float(np.radians(ends[0] - ends[1])) if name == "port_timing" else 0.0
    turns = advance + turn, advance, advance - turn
    return RippleChange(above, run(), below, turns, centre, speed_rpm / 60.0)


@lru_cache(maxsize=CACHED)
def _simulate_cached(
    pump: tuple, fluid: Fluid, speed_rpm: float, outlet: float | bytes
) -> PumpRipple:
    if isinstance(outlet, bytes):
        wave = PressureWave(np.frombuffer(outlet))
        return simulate(dict(pump), fluid, speed_rpm, wave, min_steps=STEPS_AGAINST_WAVE)
    return simulate(
        dict(pump), fluid, speed_rpm, ConstantPressure(outlet), min_steps=STEPS_PER_REVOLUTION
    )
