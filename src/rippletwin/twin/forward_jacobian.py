"""Derivatives of the forward model, all columns of the Jacobian in one sweep.

The perturbed copies of the line stand side by side as more frequencies of one network. What cannot
be told that way, because the sweep's steps are common to all copies, has exact relations:

    moving a sensor        dp/dx = -Z' q
    turning the shaft      dp/dangle = j k p at shaft order k, nonlinear load or not
    longer segment         Z' and Y' of it in proportion, then everything behind moved back

Positions of inserts are moved one by one. The orifice's nonlinear remainder is held meanwhile, two
orders below the linear part, and so is what segments store beyond proportion to the pressure. That
is no small part next to a sharp resonance: columns are wrong by some per cent, and where wave
speeds, air and a branch can stand in for each other a fit stops units of log likelihood too soon.
`follow` makes up for it by difference quotients at one place. With `freeze_compliance` it is
held in predictions too, which is all that makes them slow; else each begins where the last ended.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from rippletwin.line.frequency_domain.line_network import FrequencyDomainLine
from rippletwin.line.frequency_domain.pipe_immittance import series_impedance, shunt_admittance
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.twin import Arrays

STEP = 1e-5  # of the difference quotients, in prior standard deviations
FOLLOWED, FINELY = 3e-4, 1e-6  # the same where the storage is solved anew, and to what tolerance


class DifferentiableForward(ForwardModel):
    """`Forward` of pressures with `derivatives`."""

    def __init__(self, twin, observations):
        super().__init__(twin, observations)
        names = [p.name for p in twin.parameters]
        segments, sensors = len(twin.rig.line), len(twin.rig.sensors)
        self._lengths = range(2 * segments, 3 * segments)
        self._sensors = range(3 * segments, 3 * segments + sensors)
        self._angles = {
            i: part for i, part in zip(self.source.angles, self.slices) if i is not None
        }
        self._positions = [k for k, name in enumerate(names) if name.endswith(".position")]
        apart = {*self._sensors, *self._angles, *self._positions}
        self._together = [k for k in range(len(names)) if k not in apart]
        self._remainder = self._drains = self._held_at = None
        self._hold = False
        self.freeze_compliance = False
        self.jacobian_correction: np.ndarray | None = None

    def hold_as(self, other: DifferentiableForward) -> None:
        """Hold in predictions what `other`, of the same recordings, has found to be stored."""
        self.freeze_compliance, self._drains = True, other._drains

    def omit_compliance(self) -> None:
        """Hold nothing in predictions: as if the line stored in proportion to the pressure."""
        self.freeze_compliance, self._drains = True, None

    def use_full_jacobian(self, theta: np.ndarray) -> None:
        """Find `missed` (P, S, F), what `derivatives` at theta lack because they hold what segments
        store; from here on they have it, there and, as long as it changes little, about there."""
        self.jacobian_correction, full = None, self._extended_for_compliance[0]._full
        usual, full.tolerance = full.tolerance, FINELY
        readings = np.concatenate(self(theta), axis=1)
        held = self.derivatives(theta)
        missed = np.zeros_like(held)
        for k in (*self._together, *self._positions):
            moved = theta.copy()
            moved[k] += FOLLOWED
            slope = (np.concatenate(self(moved), axis=1) - readings) / FOLLOWED
            missed[k] = slope - held[k]
        self.jacobian_correction, full.tolerance = missed, usual

    def linear_load(self, theta: np.ndarray) -> np.ndarray | None:
        """Readings (S, F) with the orifice linear and what segments store beyond proportion as it
        is; None where there is no orifice or it is so already."""
        if self._orifice is None:
            return None
        self._predicted(theta)
        network = self._linear(theta)
        self._drain_as_held(network)
        return network.readings()

    def derivatives(self, theta: np.ndarray) -> np.ndarray:
        """d readings/d theta, (P, S, F); rows S are the rig's sensors, F all frequencies."""
        self._predicted(theta)
        self._hold = True
        base = self.network(theta)
        pressure, flow = base.respond(base.sensor_positions)
        factor = np.broadcast_to(base.sensor_factor, pressure.shape)
        readings = pressure * factor
        out = np.zeros((len(theta), *pressure.shape), complex)

        v = self.twin.arrays(theta)
        ends = np.cumsum(v.lengths)
        starts = ends - v.lengths
        segment = np.minimum(np.searchsorted(ends, v.positions), len(ends) - 1)
        slope = -base.series[segment] * flow * factor  # d reading/d position of each sensor
        for row, k in enumerate(self._sensors):
            out[k, row] = slope[row] * self._rate(k, theta)
        for k, part in self._angles.items():
            turn = 1j * self.order[part] * self._rate(k, theta)
            out[k][:, part] = turn * readings[:, part]
        for k in self._positions:
            moved = theta.copy()
            step = -STEP if theta[k] > 0 else STEP  # inwards
            moved[k] += step
            out[k] = (self.network(moved).readings() - readings) / step

        copies = self._copies(theta, base)
        out[self._together] = (
            np.moveaxis(copies[:, 1:], 1, 0) - copies[:, :1].swapaxes(0, 1)
        ) / STEP
        for row, k in enumerate(self._lengths):
            rate = self._rate(k, theta)
            behind = np.clip((v.positions - starts[row]) / v.lengths[row], 0.0, 1.0)
            out[k] -= rate * behind[:, None] * slope
            for n in self._positions:
                x = self.twin.parameters[n].value(theta[n])
                share = np.clip((x - starts[row]) / v.lengths[row], 0.0, 1.0)
                per_metre = self._rate(n, theta)
                if share > 0.0 and per_metre > 1e-9:
                    out[k] -= rate * share / per_metre * out[n]
        self._hold = False
        return (
            out
            if self.jacobian_correction is None or self.freeze_compliance
            else out + self.jacobian_correction
        )

    def _predicted(self, theta):
        """What is held is that of theta from here on."""
        if not np.array_equal(self._held_at, theta):
            self(theta)

    def _balance(self, network, theta):
        factor = self.twin.load_factor(theta)
        if self._hold:
            self._drain_as_held(network)
            if self._orifice is not None:
                self._balance_held(network, factor, self._remainder)
            return
        linear = network.load_state()
        if self.freeze_compliance:
            self.solved = True
            self._drain_as_held(network)
            self._balance_load(network, theta)
        else:
            super()._balance(network, theta)
        if network.outflows is not None:
            positions, leaving = network.outflows
            self._drains = positions / network.length, leaving
        if self._orifice is not None:
            p, q = network.load[1]
            self._remainder = (q - linear[1] / linear[0] * p) / factor

    @cached_property
    def _extended_for_compliance(self):
        wide, seen = super()._extended_for_compliance
        wide._full.resumed = True
        return wide, seen

    def __call__(self, theta):
        prediction = super().__call__(theta)
        self._held_at = np.array(theta)
        return prediction

    def _drain_as_held(self, network):
        """The flows held leave `network`, where they did in shares of its length."""
        if self._drains is not None:
            shares, leaving = self._drains
            network.outflows = shares * network.length, leaving

    @staticmethod
    def _balance_held(network, factor, remainder):
        """The load's state with the orifice's nonlinear remainder given."""
        p, q = network.load_state()
        value, remainder = q / p, factor * remainder
        a, b, c = network.load_relation()
        p = (c - b * remainder) / (a + b * value)
        network.load = "state", (p, value * p + remainder)

    def _rate(self, k: int, theta: np.ndarray) -> float:
        """d value/d coordinate of parameter k."""
        h, p = 1e-4, self.twin.parameters[k]
        return float(p.value(theta[k] + h) - p.value(theta[k] - h)) / (2 * h)

    def _copies(self, theta: np.ndarray, base: FrequencyDomainLine) -> np.ndarray:
        """Readings (S, 1 + N, F) at theta and with each parameter moved that goes together."""
        twin, rig, count = self.twin, self.twin.rig, len(self._together) + 1
        coordinates = np.repeat(theta[:, None], count, axis=1)
        coordinates[self._together, np.arange(1, count)] += STEP

        def value(k):
            return twin.parameters[k].value(coordinates[k])[:, None]

        n, load, shape = len(rig.line), twin.index.get("load"), (count, len(self.s))
        v = Arrays(
            wave_speeds=[value(k) for k in range(n)],
            diameters=[value(n + k) for k in range(n)],
            lengths=[value(2 * n + k) for k in range(n)],
            positions=base.sensor_positions,
            viscosity=value(twin.index["viscosity"]),
            load=1.0 if load is None else value(load),
        )
        source, admittance = self._sources(theta, base, shape)
        network = FrequencyDomainLine(
            s=self.s,
            lengths=base.lengths,
            series=np.empty((n, *shape), complex),
            shunt=np.empty((n, *shape), complex),
            source_admittance=admittance,
            load=self._load(v.load),
            sensor_positions=v.positions,
        )
        density = rig.fluid.density
        for k, (a, d) in enumerate(zip(v.wave_speeds, v.diameters)):
            network.series[k] = series_impedance(
                self.s, density=density, viscosity=v.viscosity, diameter=d, friction=twin.friction
            )
            network.shunt[k] = shunt_admittance(self.s, density=density, wave_speed=a, diameter=d)
        state = self.line_state(v)
        for effect, place, own in twin.effect_values(coordinates):
            own = {name: x[:, None] for name, x in own.items()}
            if "position" in own:
                own["position"] = own["position"][0, 0]
            effect.apply(network, state, own, place)
        for k, length in enumerate(v.lengths):
            network.series[k] *= length / base.lengths[k]
            network.shunt[k] *= length / base.lengths[k]

        def flat(x):
            return np.ravel(np.broadcast_to(x, shape))

        side_by_side = FrequencyDomainLine(
            s=flat(self.s),
            lengths=base.lengths,
            series=network.series.reshape(n, -1),
            shunt=network.shunt.reshape(n, -1),
            source_flow=flat(source),
            source_admittance=flat(network.source_admittance),
            inserts=[(x, kind, flat(y)) for x, kind, y in network.inserts],
            sensor_positions=v.positions,
        )
        p, q = network.load_state()
        side_by_side.load = "state", (flat(p), flat(q))
        if base.outflows is not None:
            at, leaving = base.outflows
            side_by_side.outflows = at, np.tile(leaving, count)
        if self._orifice is not None:
            self._balance_held(side_by_side, flat(v.load), flat(self._remainder))
        readings = side_by_side.readings().reshape(-1, *shape)
        return readings * np.broadcast_to(network.sensor_factor, readings.shape)

    def _sources(self, theta: np.ndarray, base: FrequencyDomainLine, shape: tuple) -> tuple:
        """Flow and, effects left out, admittance of the source at theta and with each parameter
        moved that goes together, both (1 + N, F)."""
        flow = np.array(np.broadcast_to(base.source_flow, shape))
        admittance = np.array(np.broadcast_to(self.source.at(theta)[1], shape))
        for k, (slope, curvature), own in self.source.changes:
            row = 1 + self._together.index(k)
            flow[row] += STEP * self.source.turn(theta) * (slope + 2.0 * theta[k] * curvature)
            admittance[row] += STEP * own
        return flow, admittance
