"""Pipes, junctions and cells of a line for the method of characteristics, with their state.

Pipes and junctions are those of `rippletwin.line.time_domain.discretisation`.
"""

from __future__ import annotations

import numpy as np

from rippletwin.line.time_domain import moc_kernel, weighting_functions
from rippletwin.line.time_domain.discretisation import (
    cells_of,
    discretise,
    discretise_element,
)
from rippletwin.line.time_domain.kernel_arrays import JunctionArrays, PipeArrays, StateArrays
from rippletwin.line.time_domain.line_elements import ENDS, Branch, Storage, TimeDomainLine


class Grid:
    """Pipes, junctions and their state as flat arrays, with the names of `kernel_arrays`.

    Raises ValueError as `method_of_characteristics.simulate`.
    """

    def __init__(self, line: TimeDomainLine):
        self.line, self.dt = line, line.period / len(line.flow)
        self.mean = float(np.mean(line.flow))
        self.pieces, joints = discretise(line, self.dt)
        whole = [(start, pipe) for start, pipe, k in self.pieces if k >= 0]
        self.starts, self.pipes = map(list, zip(*whole))
        self.main = len(self.pipes)
        # The first rung behind the source's own: its pump's side is the outlet, x = 0.
        own = len(line.source) + len(line.passage)
        self.outlet = own if len(joints[0]) > own else None
        self.viscosity_ratios = [1.0] * self.main
        self._number_rungs(joints)
        self._lay_nodes()
        self._set_losses()
        self._set_load()
        self._set_steady_state()

    def _number_rungs(self, joints):
        """Rungs of all junctions in a row; pipes of branches follow those of the line."""
        self.rungs = np.cumsum([0] + [len(joint) for joint in joints])
        self.ladder = [rung for joint in joints for rung in joint]
        self.kinds = np.zeros((len(self.ladder), 2), dtype=np.int64)
        self.filters = np.zeros((len(self.ladder) + 1, 5))  # the last is the load's valve
        if self.line.end.valve is not None:
            self.filters[-1] = discretise_element(self.line.end.valve, self.dt)
        laws = []
        for r, rung in enumerate(self.ladder):
            if isinstance(rung, Branch):
                self.kinds[r] = moc_kernel.BRANCH, len(self.pipes)
                self.pipes.append(rung.pipe)
                self.viscosity_ratios.append(rung.viscosity_ratio)
                self.starts.append(rung.position)
            elif isinstance(rung, Storage):
                self.kinds[r] = moc_kernel.STORAGE, len(laws)
                self.filters[r, 1] = self.dt
                laws.append(rung.law)
            else:
                self.kinds[r, 0] = {"shunt": moc_kernel.SHUNT, "series": moc_kernel.SERIES}[
                    rung.kind
                ]
                self.filters[r] = discretise_element(rung, self.dt)
        self.storages = np.zeros((max(len(laws), 1), max(map(len, [(), *laws]))))
        for row, law in zip(self.storages, laws):
            row[: len(law)] = law

    def _lay_nodes(self):
        """Nodes of each pipe: its left end, N cells on, and its right end theta cells further."""
        offsets, thetas, x, total = [], [], [], 0
        for k, (pipe, start) in enumerate(zip(self.pipes, self.starts)):
            dx, cells = pipe.wave_speed * self.dt, cells_of(pipe, self.dt)
            inner = int(np.floor(cells)) - 2
            if inner < 1:
                raise ValueError(
                    f"a pipe of {pipe.length} m is shorter than three steps of {dx} m: "
                    "take more steps a period"
                )
            offsets.append(total)
            thetas.append(cells - inner)
            along = np.append(np.arange(inner + 1) * dx, pipe.length)
            x.append(start + (along if k < self.main else 0.0 * along))
            total += inner + 2
        self.offsets, self.thetas = np.array([*offsets, total]), np.array(thetas)
        self.x, self.load_node = np.concatenate(x), int(self.offsets[self.main]) - 1
        age = np.arange(1.0, 5.0)
        self.taps = np.array(
            [[np.prod([(t - j) / (i - j) for j in age if j != i]) for i in age] for t in thetas]
        )

    def _set_losses(self):
        """Per pipe Zc, r/2, u/2 and sum_k share_k phi_k; the recursions of friction and wall.

        share_k = kappa_k dt/(2 tau_k); over a step the wall's k-th state b follows the pressure
        as b <- E b + phi (1 - E) p, E = exp(-dt/tau), phi = (1 - E) tau/dt.
        """
        line, rows, recursions = self.line, [], []
        terms = max(len(pipe.creep) for pipe in self.pipes)
        self.keep, self.follow, self.share = np.zeros((3, len(self.pipes), terms))
        self.laws = np.zeros((len(self.pipes), max(1, *(len(pipe.law) for pipe in self.pipes))))
        for k, pipe in enumerate(self.pipes):
            area, radius = 0.25 * np.pi * pipe.diameter**2, 0.5 * pipe.diameter
            inertance = line.density / area * pipe.wave_speed * self.dt
            rate = self.viscosity_ratios[k] * line.viscosity / radius**2
            soft = 0.0
            for m, (kappa, tau) in enumerate(pipe.creep):
                x = self.dt / tau
                phi = -np.expm1(-x) / x
                self.keep[k, m] = np.exp(-x)
                self.follow[k, m] = -phi * np.expm1(-x)
                self.share[k, m] = 0.5 * x * kappa
                soft += self.share[k, m] * phi
            self.laws[k, : len(pipe.law)] = pipe.law
            self.laws[k, 1:] *= line.density * pipe.wave_speed**2
            rows.append(
                (
                    line.density * pipe.wave_speed / area,
                    0.0 if line.friction == "none" else 0.5 * inertance * 8.0 * rate,
                    0.5 * inertance * 4.0 * rate if line.friction == "unsteady" else 0.0,
                    soft,
                )
            )
            recursions.append(weighting_functions.recursion(rate * self.dt))
        self.parameters = np.array(rows)
        # y_k <- e y_k + g dq - h dq_last is kept as z_k = e y_k - h dq after each step, so that
        # y_k = z_k + g dq and z_k <- e z_k + (e g - h) dq: one change of the flow is enough
        self.decays, self.gains, bends = np.array(recursions).transpose(1, 0, 2).copy()
        self.pushes = self.decays * self.gains - bends

    def _set_load(self):
        """`load` for the kernel, see `JunctionArrays`."""
        end, laws = self.line.end, {"orifice": 2, "open": 1}
        if end.kind not in ENDS:
            raise ValueError(f"end must be one of {ENDS}, not {end.kind!r}")
        if end.kind == "closed" and abs(self.mean) > 1e-9 * np.max(np.abs(self.line.flow)):
            raise ValueError("a mean flow into a closed end")
        linear = {
            "anechoic": 1.0 / self.parameters[self.main - 1, 0],
            "resistance": end.coefficient,
        }
        conductance = linear.get(end.kind, 0.0)
        constant = self.mean - conductance * end.pressure if conductance else 0.0
        law = laws.get(end.kind, 0)
        self.load = (law, end.coefficient, end.pressure, constant, conductance)

    def _steady_pressure(self, mean):
        """Pressure at every node of the line, Pa, at a steady flow `mean`: it falls linearly."""
        end, after = self.line.end, 0.0
        exit_pressure = end.pressure
        if end.kind == "orifice":
            exit_pressure += (mean / end.coefficient) ** 2
        pressure = np.empty(self.load_node + 1)
        for k in range(self.main - 1, -1, -1):
            pipe, part = self.pipes[k], slice(self.offsets[k], self.offsets[k + 1])
            drop = 2.0 * self.parameters[k, 1] * mean / (pipe.wave_speed * self.dt)
            rest = self.starts[k] + pipe.length - self.x[part]
            pressure[part] = exit_pressure + after + drop * rest
            after += drop * pipe.length
        return pressure

    def _set_steady_state(self):
        """Start from the steady flow of the mean."""
        reference = self.line.mean_flow if self.line.mean_flow is not None else self.mean
        count = self.offsets[-1]
        self.pressure, self.steady, self.flow = np.empty(count), np.empty(count), np.zeros(count)
        self.pressure[: self.load_node + 1] = self._steady_pressure(self.mean)
        self.flow[: self.load_node + 1] = self.mean
        self.steady[: self.load_node + 1] = steady = self._steady_pressure(reference)
        self.references = np.zeros(len(self.filters))
        self.filter_states = np.zeros((len(self.filters), 2))
        for r, rung in enumerate(self.ladder):
            joint = int(np.searchsorted(self.rungs, r, side="right")) - 1
            node = self.load_node if joint == self.main else self.offsets[joint]
            if self.kinds[r, 0] == moc_kernel.BRANCH:
                k = self.kinds[r, 1]
                self.pressure[self.offsets[k] : self.offsets[k + 1]] = self.pressure[node]
                self.steady[self.offsets[k] : self.offsets[k + 1]] = steady[node]
                continue
            if self.kinds[r, 0] == moc_kernel.STORAGE:
                self._set_storage(r, self.pressure[node], steady[node])
                continue
            now = self.mean, reference
            if rung.kind == "shunt":
                now = self.pressure[node], steady[node]
            self._set_filter(r, rung, *now)
        if self.line.end.valve is not None:
            self._set_filter(-1, self.line.end.valve, self.pressure[self.load_node], steady[-1])
        # A wall at rest has b = phi p = follow/(1 - keep) p.
        at_rest = self.follow / np.where(self.share > 0.0, 1.0 - self.keep, 1.0)
        sizes = np.diff(self.offsets)
        self.strain = np.repeat(at_rest.T, sizes, axis=1) * self.pressure
        self.stored = np.zeros((3, count))
        x = (self.pressure - self.steady) / np.repeat(np.maximum(self.laws[:, 0], 1.0), sizes)
        for power, c in enumerate(self.laws[:, 1:].T):
            self.stored[0] += np.repeat(c, sizes) * x ** (power + 1)
        self.memory = np.zeros((len(weighting_functions.FRICTION_RATES), count))
        self.change = np.zeros(count)
        zc = np.repeat(self.parameters[:, 0], sizes)
        loss = np.repeat(self.parameters[:, 1], sizes) * self.flow
        self.forward = self.pressure + zc * self.flow - loss
        self.backward = self.pressure - zc * self.flow + loss
        last, near = self.offsets[1:] - 1, self.offsets[1:] - 2
        self.history = np.empty((len(self.pipes), 2, 4))
        more = (self.thetas - 1.0)[:, None]
        self.history[:, 0] = (self.forward[near] - more[:, 0] * loss[near])[:, None]
        self.history[:, 1] = (self.backward[last] + more[:, 0] * loss[last])[:, None]

    def _set_filter(self, r, element, now, reference):
        """Set the steady state of a filter for the input `now`."""
        self.references[r] = reference
        u, (b0, _, b2, _, a2) = now - reference, self.filters[r]
        y = u * element.immittance(0.0)
        self.filter_states[r] = y - b0 * u, b2 * u - a2 * y

    def _set_storage(self, r, now, reference):
        """Set the steady state of a storage at the pressure `now`."""
        self.references[r], u = reference, now - reference
        law = self.storages[self.kinds[r, 1]]
        self.filter_states[r, 1], _ = moc_kernel.evaluate_law(law, u / law[0])
        moc_kernel.linearise_storage(law, self.filters[r], u, self.filter_states[r])

    def advance(self, nodes):
        """One period: pressure, Pa, and flow, m3/s, (N, M) at `nodes` (N,), see `Place`; updates
        the state."""
        flow = np.asarray(self.line.flow, dtype=float)
        return moc_kernel.advance(
            flow,
            nodes,
            self._arrays(PipeArrays),
            self._arrays(JunctionArrays),
            self._arrays(StateArrays),
        )

    def _arrays(self, kind):
        """The attributes of the grid that a tuple of `kernel_arrays` wants."""
        return kind(*(getattr(self, name) for name in kind._fields))
