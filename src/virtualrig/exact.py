"""The rig's numerics against an exact solution, on the kind of rig that concealed cases are.

For a ripple so small that the load's orifice is a resistance, a line of uniform pipes driven by a
given flow has an exact periodic solution: transfer matrices with laminar friction, steady or
unsteady (Zielke, J. Basic Eng. 90, 1968). At full ripple there is none; there the mesh is halved.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import ive

from virtualrig.draw import Drawn, draw
from virtualrig.orbit import Bench, Orbit
from virtualrig.resolution import (
    ALLOWED,
    NUMERICS,
    REFINE,
    SETTLED,
    built,
    driving,
    harmonics,
    orders,
    resolved,
    rms,
    settled,
)
from virtualrig.rig import Rig

SMALL = 1e-3
FINER, WIDER = {"points": 9.0, "degree": 8, "modes": 14}, 1.5
"""Of a finer mesh, and by how much its band of frequencies is wider."""


@dataclass(frozen=True)
class Check:
    """Error of one rig's sensors, Pa rms of the whole ripple, against `truth`; `allowed` in Pa."""

    truth: str
    error: float
    allowed: float

    @property
    def passed(self) -> bool:
        return self.error <= self.allowed

    def __str__(self) -> str:
        return f"{self.truth}: {self.error:.1f} Pa rms, allowed {self.allowed:.1f} Pa"


def checks(count: int, commit: str, number: int) -> list[Check]:
    """Three rigs drawn like the cases, but from other random numbers."""
    rigs = [draw(count, commit, f"{number} numerics", k % count) for k in range(3)]
    return [
        against_matrices(rigs[0], "steady"),
        against_matrices(rigs[1], "unsteady"),
        against_finer(rigs[2]),
    ]


def against_matrices(drawn: Drawn, friction: str) -> Check:
    """The bare line of a drawn rig at small ripple; the error is scaled to the whole ripple."""
    effects = [{"name": "unsteady_friction"}] if friction == "unsteady" else []
    rig = built(drawn, NUMERICS, effects=effects)
    point = drawn.points[0]
    flow = driving(rig, point)(point.speed_rpm)
    small = flow.mean() + SMALL * (flow - flow.mean())
    valve = flow.mean() / np.sqrt(point.load_pressure)
    noise = rig.noise
    orbit = Bench(rig, flow=small, refine=REFINE).settle(
        point.speed_rpm, point.load_pressure, valve, SMALL * SETTLED * noise
    )
    seen = orders(point.speed_rpm)
    # harmonics of the straight lines that the bench draws between the samples
    drive = 2 * np.fft.rfft(small)[seen] / len(small) * np.sinc(seen / len(small)) ** 2
    truth = transfer_matrix(rig, drive, seen * point.speed_rpm / 60, orbit, friction)
    error = rms(harmonics(orbit, seen) - truth) / SMALL
    return Check(f"exact solution, {friction} friction", float(error.max()), ALLOWED * noise)


def transfer_matrix(
    rig: Rig, drive: np.ndarray, frequency_hz: np.ndarray, orbit: Orbit, friction: str
) -> np.ndarray:
    """Pressures (sensors, F) of a bare line with flow `drive` (F,) into x = 0 and a linear load."""
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


def against_finer(drawn: Drawn) -> Check:
    """A drawn rig, whatever it conceals, at full ripple on a finer mesh and with smaller steps."""
    numerics, _ = resolved(drawn)
    finer = numerics | FINER | {"frequency": WIDER * numerics["frequency"]}
    point, rig = drawn.points[0], built(drawn, numerics)
    error = rms(settled(rig, point) - settled(built(drawn, finer), point, 2))
    return Check("finer mesh, whole ripple", float(error.max()), ALLOWED * rig.noise)
