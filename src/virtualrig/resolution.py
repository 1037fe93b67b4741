"""Choice of mesh and time step of a drawn rig: errors below a tenth of its noise.

Waves on a linear line keep their frequency, so only the harmonics below HIGHEST_HZ have to be
resolved. Air and a stiffening liquid are nonlinear: all harmonics of the pump's flow couple to
those below HIGHEST_HZ, also the unresolved ones, and the error falls with the square of the
elements' width, whatever their degree. The mesh of such a rig is refined until its error is small
enough.
"""

from collections.abc import Callable
from functools import cache, partial
from itertools import pairwise

import numpy as np

from virtualrig.draw import DrawnCase
from virtualrig.draw_rig import HIGHEST_HZ
from virtualrig.orbit import Bench, Orbit
from virtualrig.recorder import Point
from virtualrig.rig import Rig, build
from virtualrig.source import constant_pressure_flow

BASE_NUMERICS = {"frequency": 7000.0, "points": 8.0, "degree": 7, "modes": 10}
BASE_STEP_DIVISOR = 3
"""Mesh and parts of the stable time step of a linear line. Ripples are stronger and noise is weaker
than on the built-in rig, and a line that ends in a volume rings for forty revolutions, over which
errors add up: so elements have a higher degree and steps are shorter."""

MAX_REFINEMENTS = 4
"""Meshes beyond the first at most, of a nonlinear line: up to 28 kHz."""

ALLOWED_ERROR = 0.1
"""Of the noise: the largest error at any sensor, rms below HIGHEST_HZ."""

SETTLING_TOLERANCE = 0.01
"""Of the noise: change of pressures in a revolution below which they count as periodic."""


def choose_mesh(drawn: DrawnCase) -> tuple[dict, float | None]:
    """Numerics for a drawn rig, and their estimated error in Pa rms; None for a linear line.

    Elements of each mesh are narrower by the root of two than those of the one before, so an error
    of second order is halved. The finer of two meshes is then wrong by about their difference, the
    coarser by twice that. The largest error at any operating point and sensor counts. Linear lines
    are checked by `virtualrig.exact`.
    """
    if not any(p.air or p.stiffening for p in build_drawn(drawn, BASE_NUMERICS).network.pipes):
        return BASE_NUMERICS, None
    meshes = [
        BASE_NUMERICS | {"frequency": BASE_NUMERICS["frequency"] * 2 ** (0.5 * k)}
        for k in range(MAX_REFINEMENTS + 1)
    ]
    before = None
    for coarser, mesh in pairwise([None, *meshes]):
        rig = build_drawn(drawn, mesh)
        after = [settled_harmonics(rig, point) for point in drawn.points]
        if before is not None:
            error = max(float(rms_of_harmonics(a - b).max()) for a, b in zip(after, before))
            if 2 * error <= ALLOWED_ERROR * rig.noise:
                return coarser, 2 * error
            if error <= ALLOWED_ERROR * rig.noise:
                break
        before = after
    return mesh, error


def build_drawn(drawn: DrawnCase, numerics: dict, **changed) -> Rig:
    """The true rig of a drawn case; `changed` replaces entries of its seal."""
    return build(drawn.sheet, drawn.seal | {"numerics": numerics} | changed)


def step_divisor(rig: Rig) -> int:
    """Into how many parts a rig's stable time step is divided.

    The stable step is shorter on finer meshes, so fewer parts suffice there.
    """
    return max(1, round(BASE_STEP_DIVISOR * BASE_NUMERICS["frequency"] / rig.network.frequency))


def settled_harmonics(rig: Rig, point: Point, finer: int = 1) -> np.ndarray:
    """Complex peak amplitudes (sensors, orders) of the shaft orders below HIGHEST_HZ, Pa.

    Time steps are `finer` times as short as `step_divisor` makes them.
    """
    bench = Bench(rig, flow=true_flow(rig, point), step_divisor=finer * step_divisor(rig))
    tolerance = SETTLING_TOLERANCE * rig.noise
    orbit = bench.settle(point.speed_rpm, point.load_pressure, tolerance=tolerance)
    return harmonics_of_orbit(orbit, shaft_orders(point.speed_rpm))


def true_flow(rig: Rig, point: Point) -> Callable[[float], np.ndarray]:
    """Function of the speed in r/min: the true pump's flow (SAMPLES,), m3/s, over a revolution."""
    return cache(
        partial(
            constant_pressure_flow,
            rig.pump,
            rig.network.density,
            pressure=point.load_pressure,
            ripple=rig.ripple,
        )
    )


def shaft_orders(speed_rpm: float) -> np.ndarray:
    """The shaft orders below HIGHEST_HZ."""
    return np.arange(1, int(HIGHEST_HZ * 60 / speed_rpm) + 1)


def harmonics_of_orbit(orbit: Orbit, orders: np.ndarray) -> np.ndarray:
    """Complex peak amplitudes (sensors, orders) of an orbit's pressures, Pa."""
    return 2 * np.fft.rfft(orbit.pressure, axis=1)[:, orders] / orbit.pressure.shape[1]


def rms_of_harmonics(harmonics: np.ndarray) -> np.ndarray:
    """Root mean square (sensors,) of a signal with complex peak amplitudes (sensors, orders)."""
    return np.sqrt(np.sum(np.abs(harmonics) ** 2, axis=1) / 2)
