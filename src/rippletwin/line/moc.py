"""The line in the time domain by the method of characteristics (Wylie & Streeter 1993, ch. 3).

Pipes meet at junctions. A pipe of length L is cut into cells of exactly a dt, along which
p + Zc q and p - Zc q arrive unchanged but for the losses, and one last cell of theta in [2, 3)
such steps, which takes up the rest: through it the waves are delayed by theta dt, read from their
last four values by Lagrange's cubic, which is passive for these theta and exact at theta = 2. So
no wave speed is rounded to the grid, whatever dt. Over a cell the losses are trapezoidal:

    p + Zc q = [p + Zc q]_foot - dx/2 (f + f_foot) - dt/2 kappa (e' + e'_foot)

f = (rho/A)((8 nu/R^2) q + (4 nu/R^2) sum_k y_k): steady friction and `weighting`'s recursion for
the unsteady part, both implicit at the new point; e' = (p - e)/tau: the retarded strain of a
viscoelastic wall, Y' = A s/(rho a^2) (1 + kappa/(1 + s tau)), integrated exactly for a p that is
linear within the step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from rippletwin.line import weighting
from rippletwin.line.kernel import advance
from rippletwin.line.segment import FRICTIONS, series_impedance, shunt_admittance

ENDS = ("orifice", "open", "closed", "anechoic", "resistance")


@dataclass(frozen=True)
class Pipe:
    """Length and diameter in m, wave speed in m/s; `creep` kappa and `retardation` tau (s) of a
    viscoelastic wall, whose elastic part is in the wave speed."""

    length: float
    diameter: float
    wave_speed: float
    creep: float = 0.0
    retardation: float = 1.0


@dataclass(frozen=True)
class Shunt:
    """What hangs on the line at `position` (m); x = 0 is the pump, x = L the load.

    q = C dp/dt + G p + flow into the branch: `capacitance` V/(rho a^2) of a volume in m3/Pa,
    `conductance` of a leak in m3/(Pa s), `branch` a pipe with its far end closed.
    """

    position: float
    capacitance: float = 0.0
    conductance: float = 0.0
    branch: Pipe | None = None


@dataclass(frozen=True)
class End:
    """The load. kind and its numbers:

    "orifice"     q = K sqrt(p - p0): `coefficient` K, `pressure` p0 behind it
    "open"        p = p0
    "closed"      q = 0
    "anechoic"    q = q0 + (p - p0)/Zc, Zc that of the lossless last pipe, q0 the mean flow
    "resistance"  q = q0 + G (p - p0): `coefficient` G
    """

    kind: str
    pressure: float = 0.0
    coefficient: float = 0.0


@dataclass(frozen=True)
class Transient:
    """The last period at the positions asked for.

    pressure, flow   (S, M) Pa and m3/s, M steps a period
    change           largest change of the pressure anywhere on the line from the period before,
                     over the largest rms ripple among the positions and the line's two ends
    worst_position   where that is, m from the pump (of the junction, within a branch)
    converged        change below the tolerance
    periods          how many were computed
    remainder        (n,) what of each segment is no whole number of cells, in cells, [0, 1)
    """

    pressure: np.ndarray
    flow: np.ndarray
    change: float
    worst_position: float
    converged: bool
    periods: int
    remainder: np.ndarray

    def harmonics(self, orders: np.ndarray) -> np.ndarray:
        """Peak complex amplitudes (S, F) of the pressure at whole `orders` (F,) of the period."""
        return np.fft.rfft(self.pressure)[:, orders] * (2.0 / self.pressure.shape[1])


def steps_a_period(segments: Sequence[Pipe], period: float, at_least: int) -> int:
    """Steps a period, from `at_least` to a tenth more, that leave the smallest remainders."""
    steps = np.arange(at_least, at_least + max(at_least // 10, 1))
    cells = np.array([p.length / p.wave_speed for p in segments])[:, None] * steps / period
    rest = cells % 1.0
    return int(steps[np.argmin(np.sum(rest * (1.0 - rest), axis=0))])


def simulate(
    segments: Sequence[Pipe],
    flow: np.ndarray,
    period: float,
    end: End,
    *,
    density: float,
    viscosity: float,
    friction: str = "unsteady",
    positions: Sequence[float] = (),
    shunts: Sequence[Shunt] = (),
    periods: int = 60,
    tolerance: float = 1e-6,
) -> Transient:
    """Drive the line with a periodic flow until it repeats itself.

    segments  pump first; flow  (M,) m3/s of the pump at M even steps of a `period` (s), so
    dt = period/M; `friction` as in `segment.series_impedance` with kinematic `viscosity`;
    `positions` (S,) m where pressure and flow are wanted (flow beside a shunt: pump's side).
    Starts from the steady flow of the mean and stops when `tolerance` or `periods` is reached.

    Raises ValueError for an unknown friction or end, a position outside the line, a mean flow
    into a closed end, or a pipe shorter than three steps (take more steps a period).
    """
    if friction not in FRICTIONS:
        raise ValueError(f"friction must be one of {FRICTIONS}, not {friction!r}")
    flow = np.asarray(flow, dtype=float)
    grid = _Grid(segments, shunts, end, flow, period, density, viscosity, friction)
    places = [grid.locate(x) for x in positions]
    nodes = np.array([node for _, node, _ in places] + [0, grid.load_node], dtype=np.int64)

    before = grid.pressure.copy()
    done, change, worst = 0, np.inf, 0
    while done < periods and not change < tolerance:
        pressure, rate = grid.advance(flow, nodes)
        done += 1
        ripple = np.max(np.std(pressure, axis=1))
        difference = np.abs(grid.pressure - before)
        worst = int(np.argmax(difference))
        change = difference[worst] / ripple if ripple > 0 else difference[worst]
        before = grid.pressure.copy()

    for k, (pipe, _, offset) in enumerate(places):
        if offset != 0.0:
            pressure[k], rate[k] = grid.shift(pipe, offset, pressure[k], rate[k])
    return Transient(
        pressure=pressure[:-2],
        flow=rate[:-2],
        change=float(change),
        worst_position=float(grid.x[worst]),
        converged=bool(change < tolerance),
        periods=done,
        remainder=np.array([p.length / (p.wave_speed * period / len(flow)) % 1 for p in segments]),
    )


class _Grid:
    """Pipes and junctions as flat arrays, and their state."""

    def __init__(self, segments, shunts, end, flow, period, density, viscosity, friction):
        self.density, self.viscosity, self.friction = density, viscosity, friction
        self.period, self.dt = period, period / len(flow)
        self.pipes, self.starts, ends, shunts = _split(segments, shunts)
        main = len(self.pipes)
        junctions = main + 1 + sum(s.branch is not None for s in shunts)
        self.capacitance, self.conductance = np.zeros(junctions), np.zeros(junctions)
        links = [(k, k + 1) for k in range(main)]
        for shunt in shunts:
            k = int(np.argmin(np.abs(ends - shunt.position)))
            self.capacitance[k] += shunt.capacitance
            self.conductance[k] += shunt.conductance
            if shunt.branch is not None:
                self.pipes.append(shunt.branch)
                self.starts.append(shunt.position)
                links.append((k, main + 1 + len(links) - main))
        self.links = np.array(links)
        self._lay(main)
        self._losses()
        self._end(end, main, flow)
        self._start(main, float(np.mean(flow)))

    def _lay(self, main):
        """Nodes: first the left end, N cells on, then the right end theta cells further."""
        offsets, thetas, x, total = [], [], [], 0
        for k, (pipe, start) in enumerate(zip(self.pipes, self.starts)):
            dx = pipe.wave_speed * self.dt
            # A length that is whole but for rounding counts as whole.
            cells = pipe.length / dx
            cells = round(cells) if abs(cells - round(cells)) < 1e-9 * max(cells, 1) else cells
            inner = int(np.floor(cells)) - 2
            if inner < 1:
                raise ValueError(
                    f"a pipe of {pipe.length} m is shorter than three steps of {dx} m: "
                    "take more steps a period"
                )
            offsets.append(total)
            thetas.append(cells - inner)
            along = np.append(np.arange(inner + 1) * dx, pipe.length)
            x.append(start + (along if k < main else 0.0 * along))
            total += inner + 2
        self.offsets, self.thetas = np.array([*offsets, total]), np.array(thetas)
        self.x, self.load_node = np.concatenate(x), int(self.offsets[main]) - 1
        age = np.arange(1.0, 5.0)
        self.taps = np.array(
            [[np.prod([(t - j) / (i - j) for j in age if j != i]) for i in age] for t in thetas]
        )

    def _losses(self):
        """Per pipe, columns of `parameters`: Zc, r/2, u/2, kappa dt/2, E, phi, 1/tau."""
        rows, recursions = [], []
        for pipe in self.pipes:
            area, radius = 0.25 * np.pi * pipe.diameter**2, 0.5 * pipe.diameter
            inertance = self.density / area * pipe.wave_speed * self.dt
            rate = self.viscosity / radius**2
            x = self.dt / pipe.retardation
            rows.append(
                (
                    self.density * pipe.wave_speed / area,
                    0.0 if self.friction == "none" else 0.5 * inertance * 8.0 * rate,
                    0.5 * inertance * 4.0 * rate if self.friction == "unsteady" else 0.0,
                    0.5 * self.dt * pipe.creep,
                    np.exp(-x),
                    -np.expm1(-x) / x,
                    1.0 / pipe.retardation,
                )
            )
            recursions.append(weighting.recursion(rate * self.dt))
        self.parameters = np.array(rows)
        self.decays, self.gains, self.bends = np.array(recursions).transpose(1, 0, 2).copy()

    def _end(self, end, junction, flow):
        """(kind, coefficient, pressure, constant flow) of the load's junction for the kernel."""
        mean, kinds = float(np.mean(flow)), {"orifice": 2, "open": 1}
        if end.kind not in ENDS:
            raise ValueError(f"end must be one of {ENDS}, not {end.kind!r}")
        if end.kind == "closed" and abs(mean) > 1e-9 * np.max(np.abs(flow)):
            raise ValueError("a mean flow into a closed end")
        conductance = {"anechoic": 1.0 / self.parameters[junction - 1, 0]}.get(
            end.kind, end.coefficient
        )
        constant = 0.0
        if end.kind in ("anechoic", "resistance"):
            self.conductance[junction] += conductance
            constant = mean - conductance * end.pressure
        self.load = (kinds.get(end.kind, 0), junction, end.coefficient, end.pressure, constant)
        self.mean_load_pressure = end.pressure
        if end.kind == "orifice":
            self.mean_load_pressure += (mean / end.coefficient) ** 2

    def _start(self, main, mean):
        """Steady flow of the mean: pressure falls linearly along the line."""
        count = self.offsets[-1]
        self.pressure, self.flow = np.empty(count), np.zeros(count)
        drop = [
            2.0 * self.parameters[k, 1] * mean / (self.pipes[k].wave_speed * self.dt)
            for k in range(main)
        ]
        entry = self.mean_load_pressure
        entry += sum(d * self.pipes[k].length for k, d in enumerate(drop))
        joint = [entry]
        for k in range(len(self.pipes)):
            part = slice(self.offsets[k], self.offsets[k + 1])
            if k < main:
                self.pressure[part] = joint[k] - drop[k] * (self.x[part] - self.starts[k])
                self.flow[part] = mean
                joint.append(joint[k] - drop[k] * self.pipes[k].length)
            else:
                self.pressure[part] = joint[self.links[k, 0]]
        self.strain = self.pressure.copy()
        self.memory = np.zeros((len(weighting.N), count))
        self.change, self.last_change = np.zeros(count), np.zeros(count)
        self.shunt_flow = np.zeros(len(self.capacitance))
        zc = np.repeat(self.parameters[:, 0], np.diff(self.offsets))
        loss = np.repeat(self.parameters[:, 1], np.diff(self.offsets)) * self.flow
        self.forward = self.pressure + zc * self.flow - loss
        self.backward = self.pressure - zc * self.flow + loss
        last, near = self.offsets[1:] - 1, self.offsets[1:] - 2
        self.history = np.empty((len(self.pipes), 2, 4))
        more = (self.thetas - 1.0)[:, None]
        self.history[:, 0] = (self.forward[near] - more[:, 0] * loss[near])[:, None]
        self.history[:, 1] = (self.backward[last] + more[:, 0] * loss[last])[:, None]

    def advance(self, flow, nodes):
        """One period: pressure and flow (len(nodes), M) at `nodes`, the state moved on."""
        return advance(
            flow,
            nodes,
            self.dt,
            self.offsets,
            self.thetas,
            self.taps,
            self.links,
            self.parameters,
            self.decays,
            self.gains,
            self.bends,
            self.capacitance,
            self.conductance,
            self.load,
            self.pressure,
            self.flow,
            self.forward,
            self.backward,
            self.strain,
            self.memory,
            self.change,
            self.last_change,
            self.history,
            self.shunt_flow,
        )

    def locate(self, x):
        """(pipe, nearest node, distance from it to x towards the load, m)."""
        main = self.load[1]
        edges = np.append(self.starts[:main], self.starts[main - 1] + self.pipes[main - 1].length)
        if not -1e-12 <= x <= edges[-1] * (1 + 1e-12):
            raise ValueError(f"position {x} m lies outside the line of {edges[-1]} m")
        # On an edge the pipe on the pump's side, whose flow has not passed the shunt there.
        k = max(int(np.searchsorted(edges, x, side="left")) - 1, 0)
        nodes = np.arange(self.offsets[k], self.offsets[k + 1])
        node = int(nodes[np.argmin(np.abs(self.x[nodes] - x))])
        offset = x - self.x[node]
        return k, node, 0.0 if abs(offset) < 1e-9 * edges[-1] else float(offset)

    def shift(self, pipe, offset, pressure, flow):
        """Periodic pressure and flow (M,) a fraction of a cell further on, by the exact line."""
        given = self.pipes[pipe]
        p, q = np.fft.rfft(pressure), np.fft.rfft(flow)
        s = 2j * np.pi * np.arange(1, len(p)) / self.period
        fluid = {"density": self.density, "diameter": given.diameter}
        z = series_impedance(s, viscosity=self.viscosity, friction=self.friction, **fluid)
        y = shunt_admittance(s, wave_speed=given.wave_speed, **fluid)
        y = y * (1.0 + given.creep / (1.0 + s * given.retardation))
        gamma, zc = np.sqrt(z * y), np.sqrt(z / y)
        c, d = np.cosh(gamma * offset), np.sinh(gamma * offset)
        resistance = 2.0 * self.parameters[pipe, 1] / (given.wave_speed * self.dt)
        p[0] -= resistance * offset * q[0]
        p[1:], q[1:] = c * p[1:] - zc * d * q[1:], c * q[1:] - d / zc * p[1:]
        return np.fft.irfft(p, len(pressure)), np.fft.irfft(q, len(flow))


def _split(segments, shunts):
    """Segments cut where shunts are: pipes, their starts, the junctions' positions, the shunts."""
    edges = np.concatenate([[0.0], np.cumsum([p.length for p in segments])])
    cuts = [s.position for s in shunts]
    if any(not 0.0 <= x <= edges[-1] * (1 + 1e-12) for x in cuts):
        raise ValueError(f"a shunt lies outside the line of {edges[-1]} m")
    ends = np.array(sorted(set(edges) | {x for x in cuts if np.min(np.abs(edges - x)) > 1e-9}))
    pipes, starts = [], []
    for a, b in pairwise(ends):
        parent = segments[int(np.searchsorted(edges, a, side="right")) - 1]
        whole = abs((b - a) - parent.length) < 1e-12 * parent.length
        length = parent.length if whole else b - a
        rest = (parent.diameter, parent.wave_speed, parent.creep, parent.retardation)
        pipes.append(Pipe(float(length), *rest))
        starts.append(float(a))
    return pipes, starts, ends, shunts
