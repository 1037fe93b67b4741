"""Checks of the rig's numerics on rigs drawn like the concealed cases.

At a ripple so small that the load's orifice is a resistance, a line of uniform pipes driven by a
given flow has an exact periodic solution: transfer matrices with laminar friction, steady or
unsteady (Zielke, J. Basic Eng. 90, 1968). At the whole ripple a finer mesh is the reference.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import ive

from virtualrig.draw import DrawnCase, draw_case
from virtualrig.orbit import Bench, Orbit
from virtualrig.resolution import (
    ALLOWED_ERROR,
    BASE_NUMERICS,
    BASE_STEP_DIVISOR,
    SETTLING_TOLERANCE,
    build_drawn,
    choose_mesh,
    harmonics_of_orbit,
    rms_of_harmonics,
    settled_harmonics,
    shaft_orders,
    true_flow,
)
from virtualrig.rig import Rig

SMALL_RIPPLE = 1e-3  # of the whole
FINER_MESH = {"points": 9.0, "degree": 8, "modes": 14}
FINER_BAND = 1.5  # of the mesh's highest frequency
ESTIMATE_FACTOR = 1.5
"""Largest error over the one that two meshes let expect: an order of two is not exact."""


@dataclass(frozen=True)
class Check:
    """Largest error at a rig's sensors against `truth`, and the allowed one, Pa rms."""

    truth: str
    error: float
    allowed: float

    @property
    def passed(self) -> bool:
        return self.error <= self.allowed

    def __str__(self) -> str:
        return f"{self.truth}: {self.error:.1f} Pa rms, allowed {self.allowed:.1f} Pa"


def check_numerics(count: int, commit: str, number: int) -> list[Check]:
    """Checks of three rigs, drawn like the cases from other random numbers."""
    rigs = [draw_case(count, commit, f"{number} numerics", k % count) for k in range(3)]
    return [
        check_against_matrices(rigs[0], "steady"),
        check_against_matrices(rigs[1], "unsteady"),
        check_against_finer(rigs[2]),
    ]


def check_against_matrices(drawn: DrawnCase, friction: str) -> Check:
    """The line of a drawn rig, without effects, at small ripple; the error is scaled up.

    `friction` is "steady" or "unsteady".
    """
    effects = [{"name": "unsteady_friction"}] if friction == "unsteady" else []
    rig = build_drawn(drawn, BASE_NUMERICS, effects=effects)
    point = drawn.points[0]
    flow = true_flow(rig, point)(point.speed_rpm)
    small = flow.mean() + SMALL_RIPPLE * (flow - flow.mean())
    valve = flow.mean() / np.sqrt(point.load_pressure)
    noise = rig.noise
    orbit = Bench(rig, flow=small, step_divisor=BASE_STEP_DIVISOR).settle(
        point.speed_rpm, point.load_pressure, valve, SMALL_RIPPLE * SETTLING_TOLERANCE * noise
    )
    seen = shaft_orders(point.speed_rpm)
    # harmonics of the straight lines that the bench draws between the samples
    drive = 2 * np.fft.rfft(small)[seen] / len(small) * np.sinc(seen / len(small)) ** 2
    truth = transfer_matrix(rig, drive, seen * point.speed_rpm / 60, orbit, friction)
    error = rms_of_harmonics(harmonics_of_orbit(orbit, seen) - truth) / SMALL_RIPPLE
    return Check(f"exact solution, {friction} friction", float(error.max()), ALLOWED_ERROR * noise)


def transfer_matrix(
    rig: Rig, drive: np.ndarray, frequency_hz: np.ndarray, orbit: Orbit, friction: str
) -> np.ndarray:
    """Pressures (sensors, F), Pa, of a line with a linear load and flow `drive` (F,) into x = 0."""
    s = 2j * np.pi * frequency_hz
    density, viscosity = rig.network.density, rig.network.viscosity
    load = 0.5 * orbit.valve / np.sqrt(orbit.load_pressure)

    def pipe(k: int, length: float) -> np.ndarray:
        p = rig.network.pipes[k]
        area, radius = np.pi / 4 * p.diameter**2, p.diameter / 2
        if friction == "unsteady":
            z = radius * np.sqrt(s / viscosity)
            series = density / area * s * ive(0, z) / ive(2, z)
        else:
            series = density / area * (s + 8 * viscosity / radius**2)
        shunt = area * s / (density * p.wave_speed**2)
        along, impedance = np.sqrt(series * shunt) * length, np.sqrt(series / shunt)
        rows = [[np.cosh(along), impedance * np.sinh(along)]]
        rows += [[np.sinh(along) / impedance, np.cosh(along)]]
        return np.array(rows).transpose(2, 0, 1)

    whole = np.tile(np.eye(2, dtype=complex), (len(s), 1, 1))
    starts = []
    for k, p in enumerate(rig.network.pipes):
        starts.append(whole)
        whole = whole @ pipe(k, p.length)
    entry = drive * (whole[:, 0, 0] + whole[:, 0, 1] * load)
    entry = entry / (whole[:, 1, 0] + whole[:, 1, 1] * load)
    state = np.stack([entry, drive], axis=1)[..., None]
    return np.array(
        [np.linalg.solve(starts[k] @ pipe(k, x), state)[:, 0, 0] for k, x in rig.network.sensors]
    )


def check_against_finer(drawn: DrawnCase) -> Check:
    """A drawn rig with its effects, at the whole ripple, on a finer mesh with shorter steps.

    Where the finest mesh is not fine enough, `choose_mesh` says so by its estimate, and this checks
    the estimate: the error may be ESTIMATE_FACTOR times as large.
    """
    numerics, estimate = choose_mesh(drawn)
    finer = numerics | FINER_MESH | {"frequency": FINER_BAND * numerics["frequency"]}
    point, rig = drawn.points[0], build_drawn(drawn, numerics)
    error = rms_of_harmonics(
        settled_harmonics(rig, point) - settled_harmonics(build_drawn(drawn, finer), point, 2)
    )
    allowed = ALLOWED_ERROR * rig.noise
    if estimate is not None and estimate > allowed:
        allowed = ESTIMATE_FACTOR * estimate
    return Check("finer mesh, whole ripple", float(error.max()), allowed)
