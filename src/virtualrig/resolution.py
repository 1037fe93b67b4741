"""How fine a drawn rig's mesh and steps must be for its error to stay below a tenth of its noise.

Waves on a linear line keep to their frequency: harmonics below HIGHEST_HZ need only be resolved
themselves. Where the liquid yields less than in proportion to the pressure, as with air in it, all
harmonics of the pump's flow feed those below, also the unresolved ones, and the error falls with
the square of the elements' width, whatever their degree. There the mesh is refined rig by rig.
"""

from functools import cache, partial
from itertools import pairwise

import numpy as np

from virtualrig.draw import HIGHEST_HZ, Drawn
from virtualrig.orbit import Bench, Orbit
from virtualrig.recorder import Point
from virtualrig.rig import Rig, build
from virtualrig.source import constant_pressure_flow

NUMERICS = {"frequency": 7000.0, "points": 8.0, "degree": 7, "modes": 10}
REFINE = 3
"""Of a linear line: ripples are stronger and noise is weaker here than on the built-in rig, and a
line that ends in a volume rings on for forty revolutions, so that errors add up: hence elements of
higher degree and a third of the stable time step. Finer meshes have steps of about that size."""

FINEST = 4
"""Meshes beyond the first at most, of a line that is not linear: up to 28 kHz."""

ALLOWED = 0.1
"""Of the noise: the largest error at any sensor, rms below HIGHEST_HZ."""

SETTLED = 0.01
"""Pressures are periodic when they change by less than this share of the noise in a revolution."""


def resolved(drawn: Drawn) -> tuple[dict, float | None]:
    """Numerics for a drawn rig, and the error that they leave, Pa rms, estimated; None for a linear
    line, of which `virtualrig.exact` tries some.

    Each mesh has elements narrower by the root of two than the one before, so that an error of
    second order is halved: the finer of two is wrong by about what they differ, the coarser by
    twice as much. The largest error at any operating point counts.
    """
    if not any(p.air or p.stiffening for p in built(drawn, NUMERICS).network.pipes):
        return NUMERICS, None
    meshes = [
        NUMERICS | {"frequency": NUMERICS["frequency"] * 2 ** (0.5 * k)} for k in range(FINEST + 1)
    ]
    before = None
    for coarser, mesh in pairwise([None, *meshes]):
        rig = built(drawn, mesh)
        after = [settled(rig, point) for point in drawn.points]
        if before is not None:
            error = max(float(rms(a - b).max()) for a, b in zip(after, before))
            if 2 * error <= ALLOWED * rig.noise:
                return coarser, 2 * error
            if error <= ALLOWED * rig.noise:
                break
        before = after
    return mesh, error


def built(drawn: Drawn, numerics: dict, **changed) -> Rig:
    """The true rig of a drawn case, entries of its seal changed."""
    return build(drawn.sheet, drawn.seal | {"numerics": numerics} | changed)


def refine(rig: Rig) -> int:
    """Parts of the stable time step of a rig's mesh, which grows shorter with its elements."""
    return max(1, round(REFINE * NUMERICS["frequency"] / rig.network.frequency))


def settled(rig: Rig, point: Point, finer: int = 1) -> np.ndarray:
    """Complex amplitudes (sensors, orders) of the shaft's orders below HIGHEST_HZ, Pa; with time
    steps `finer` times as short as `refine` says."""
    bench = Bench(rig, flow=driving(rig, point), refine=finer * refine(rig))
    orbit = bench.settle(point.speed_rpm, point.load_pressure, tolerance=SETTLED * rig.noise)
    return harmonics(orbit, orders(point.speed_rpm))


def driving(rig: Rig, point: Point):
    """Function of the speed in r/min: the true pump's flow (SAMPLES,), which drives the line."""
    return cache(
        partial(
            constant_pressure_flow,
            rig.pump,
            rig.network.density,
            pressure=point.load_pressure,
            ripple=rig.ripple,
        )
    )


def orders(speed_rpm: float) -> np.ndarray:
    """The shaft's orders below HIGHEST_HZ."""
    return np.arange(1, int(HIGHEST_HZ * 60 / speed_rpm) + 1)


def harmonics(orbit: Orbit, orders: np.ndarray) -> np.ndarray:
    """Complex amplitudes (sensors, orders) of an orbit's pressures, Pa."""
    return 2 * np.fft.rfft(orbit.pressure, axis=1)[:, orders] / orbit.pressure.shape[1]


def rms(harmonics: np.ndarray) -> np.ndarray:
    """Root mean square (sensors,) of a pressure of these amplitudes."""
    return np.sqrt(np.sum(np.abs(harmonics) ** 2, axis=1) / 2)
