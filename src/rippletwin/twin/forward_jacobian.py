"""Derivatives of the forward model, all columns of the Jacobian in one sweep.

The perturbed copies of the line are solved side by side, as more frequencies of one line. The steps
of the sweep are common to all copies; parameters that change these steps have exact relations:

    moving a sensor        dp/dx = -Z' q
    turning the shaft      dp/dangle = j k p at shaft order k, nonlinear load or not
    longer segment         Z' and Y' of it in proportion, then everything behind moved back
    numbers of the pump    dp/dq of the ideal source is Z, dp/dY of its admittance -Z p at the pump

Positions of inserts are moved one by one. Two nonlinear parts are frozen meanwhile: the orifice's
remainder, two orders below its linear part, and the outflows of nonlinear compliance. The latter
are no small part near a sharp resonance: columns are wrong by some per cent, and where wave speeds,
air and a branch can replace each other a fit stops units of log likelihood too soon.
`use_full_jacobian` adds what is missing, by difference quotients at one theta.

`freeze_compliance` freezes the outflows in predictions too, since solving them is what takes the
time. Otherwise each solution starts from the last one.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property

import numpy as np

from rippletwin.line.frequency_domain.line_network import FrequencyDomainLine
from rippletwin.line.frequency_domain.pipe_immittance import series_impedance, shunt_admittance
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.twin import Arrays, Twin

STEP = 1e-5  # of the difference quotients, in prior standard deviations
SOLVED_STEP = 3e-4  # the same where the nonlinear compliance is solved at each point
SOLVED_TOLERANCE = 1e-6  # of that solution


class DifferentiableForward(ForwardModel):
    """Forward model of pressures with `derivatives`.

    freeze_compliance    whether predictions use the outflows of the last one
    jacobian_correction  (P, S, F) that `derivatives` adds, or None
    """

    def __init__(self, twin: Twin, observations: Sequence):
        super().__init__(twin, observations)
        names = [p.name for p in twin.parameters]
        segments, sensors = len(twin.rig.line), len(twin.rig.sensors)
        self._lengths = range(2 * segments, 3 * segments)
        self._sensors = range(3 * segments, 3 * segments + sensors)
        self._angles = {
            i: part for i, part in zip(self.source.angles, self.slices) if i is not None
        }
        self._positions = [k for k, name in enumerate(names) if name.endswith(".position")]
        pump = {k for k, *_ in self.source.changes}
        apart = {*self._sensors, *self._angles, *self._positions, *pump}
        self._together = [k for k in range(len(names)) if k not in apart]
        self._remainder = self._outflows = self._frozen_at = self._linear_readings = None
        self._freeze = False
        self.freeze_compliance = False
        self.jacobian_correction: np.ndarray | None = None

    def hold_as(self, other: DifferentiableForward) -> None:
        """Freeze what is nonlinear as in `other`, a model of the same recordings: the outflows in
        predictions, the orifice's remainder also in `predict_held`."""
        self.freeze_compliance, self._outflows = True, other._outflows
        self._remainder = other._remainder

    def predict_held(self, theta: np.ndarray) -> list[np.ndarray]:
        """The prediction at theta (P,) with everything nonlinear as it was solved last."""
        with self._held():
            return self._read(self.network(theta), theta)

    @contextmanager
    def _held(self) -> Iterator[None]:
        """A context in which networks take everything nonlinear as it was solved last."""
        self._freeze = True
        try:
            yield
        finally:
            self._freeze = False

    def omit_compliance(self) -> None:
        """Freeze the outflows at zero, as if the compliance were linear."""
        self.freeze_compliance, self._outflows = True, None

    def use_full_jacobian(self, theta: np.ndarray) -> None:
        """Set `jacobian_correction` to what `derivatives` lack at theta (P,) because the outflows
        are frozen. It serves at theta and about it, as long as it changes little."""
        self.jacobian_correction = None
        solver = self._extended_for_compliance[0].compliance_solver
        usual, solver.tolerance = solver.tolerance, SOLVED_TOLERANCE
        readings = np.concatenate(self(theta), axis=1)
        frozen = self.derivatives(theta)
        correction = np.zeros_like(frozen)
        for k in (*self._together, *self._positions):
            moved = theta.copy()
            moved[k] += SOLVED_STEP
            slope = (np.concatenate(self(moved), axis=1) - readings) / SOLVED_STEP
            correction[k] = slope - frozen[k]
        self.jacobian_correction, solver.tolerance = correction, usual

    def predict_side_by_side(self, thetas: np.ndarray) -> list[np.ndarray]:
        """Pressures, one observation at a time (N, S, F), at `thetas` (N, P), which differ in wave
        speeds alone; what is nonlinear is as solved at the first."""
        self._solve_at(thetas[0])
        with self._held():
            readings = self._side_by_side(thetas.T, self.network(thetas[0]))
        return [
            np.moveaxis(readings[rows, :, part], 1, 0) for part, rows in zip(self.slices, self.rows)
        ]

    def linear_load(self, theta: np.ndarray) -> np.ndarray | None:
        """Readings (S, F), Pa, with a linear orifice and the outflows of theta (P,); None without
        an orifice, where they are those of the prediction."""
        if self.load.orifice is None:
            return None
        self._solve_at(theta)
        if self._linear_readings is not None:
            return self._linear_readings
        network = self._linear(theta)
        self._set_frozen_outflows(network)
        return network.readings()

    def derivatives(self, theta: np.ndarray) -> np.ndarray:
        """d readings/d theta, (P, S, F), Pa per unit of a coordinate; rows S are the rig's sensors,
        F all frequencies."""
        self._solve_at(theta)
        with self._held():
            columns = self._derivatives_held(theta)
        if self.jacobian_correction is None or self.freeze_compliance:
            return columns
        return columns + self.jacobian_correction

    def _derivatives_held(self, theta: np.ndarray) -> np.ndarray:
        """`derivatives` with everything nonlinear as it was solved last."""
        base = self.network(theta)
        at = (*base.sensor_positions, 0.0)
        pressure, flow, transfer = base.respond_with_transfer(at)
        at_pump = pressure[-1] + base.source_impedance * flow[-1]
        pressure, flow, transfer = pressure[:-1], flow[:-1], transfer[:-1]
        factor = np.broadcast_to(base.sensor_factor, pressure.shape)
        readings = pressure * factor
        out = np.zeros((len(theta), *pressure.shape), complex)

        turn = self.source.turn(theta)
        for k, (linear, square), own in self.source.changes:
            added = turn * (linear + 2.0 * theta[k] * square) - own * at_pump
            out[k] = factor * transfer * added
        v = self.twin.arrays(theta)
        ends = np.cumsum(v.lengths)
        starts = ends - v.lengths
        segment = np.minimum(np.searchsorted(ends, v.positions), len(ends) - 1)
        slope = -base.series[segment] * flow * factor  # d reading/d position of each sensor
        for row, k in enumerate(self._sensors):
            out[k, row] = slope[row] * self._rate(k, theta)
        for k, part in self._angles.items():
            out[k][:, part] = 1j * self.order[part] * self._rate(k, theta) * readings[:, part]
        for k in self._positions:
            moved = theta.copy()
            step = -STEP if theta[k] > 0 else STEP  # inwards
            moved[k] += step
            out[k] = (self.network(moved).readings() - readings) / step

        coordinates = np.repeat(theta[:, None], len(self._together) + 1, axis=1)
        coordinates[self._together, np.arange(1, len(self._together) + 1)] += STEP
        copies = self._side_by_side(coordinates, base)
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
        return out

    def _solve_at(self, theta):
        """Solve the nonlinear parts at theta, unless that is where they were solved last."""
        if not np.array_equal(self._frozen_at, theta):
            self(theta)

    @property
    def _orifice_is_exact(self):
        return not self._freeze and super()._orifice_is_exact

    def _balance(self, network, theta, whole):
        factor = self.twin.load_factor(theta)
        if self._freeze:
            self._set_frozen_outflows(network)
            if self.load.orifice is not None:
                network.load_outflow = factor * self._remainder
            return None
        linear = network.load_state()
        if self.freeze_compliance and whole is None:
            self._set_frozen_outflows(network)
            balance = self._balance_load(network, theta)
        else:
            balance = super()._balance(network, theta, whole)
        if network.outflows is not None:
            positions, outflow = network.outflows
            self._outflows = positions / network.length, outflow
        if self.load.orifice is not None:
            p, q = network.load[1]
            self._remainder = (q - linear[1] / linear[0] * p) / factor
        return balance

    @cached_property
    def _extended_for_compliance(self):
        wide, seen = super()._extended_for_compliance
        wide.compliance_solver.warm_start = True
        return wide, seen

    def _solve(self, theta):
        network, balance = super()._solve(theta)
        if not self._freeze:
            self._frozen_at = np.array(theta)
            self._linear_readings = balance and balance.linear_readings
        return network, balance

    def _set_frozen_outflows(self, network):
        """Set the frozen outflows of `network`, at the same shares of its length."""
        if self._outflows is not None:
            shares, outflow = self._outflows
            network.outflows = shares * network.length, outflow

    def _rate(self, k: int, theta: np.ndarray) -> float:
        """d value/d coordinate of parameter k."""
        h, p = 1e-4, self.twin.parameters[k]
        return float(p.value(theta[k] + h) - p.value(theta[k] - h)) / (2 * h)

    def _side_by_side(self, coordinates: np.ndarray, base: FrequencyDomainLine) -> np.ndarray:
        """Readings (S, N, F) at the columns of `coordinates` (P, N). They differ in parameters that
        change neither the steps of the sweep nor the ideal source; `base` is the network of the
        first."""
        twin, rig, count = self.twin, self.twin.rig, coordinates.shape[1]

        def value(k):
            return twin.parameters[k].value(coordinates[k])[:, None]

        n, load, shape = len(rig.line), twin.index.get("load"), (count, len(self.s))
        v = Arrays(
            wave_speeds=np.array([value(k) for k in range(n)]),
            diameters=np.array([value(n + k) for k in range(n)]),
            lengths=np.array([value(2 * n + k) for k in range(n)]),
            positions=np.asarray(base.sensor_positions),
            viscosity=value(twin.index["viscosity"]),
            load=1.0 if load is None else value(load),
            reflection=twin.reflection(coordinates),
            gains=twin.gains(coordinates),
        )
        v = self._as_recorded(coordinates, v)
        admittance = np.array(np.broadcast_to(self.source.at(coordinates[:, 0])[1], shape))
        network = FrequencyDomainLine(
            s=self.s,
            lengths=base.lengths,
            series=np.empty((n, *shape), complex),
            shunt=np.empty((n, *shape), complex),
            source_admittance=admittance,
            load=self.load.linear_relation(v),
            sensor_positions=v.positions,
            sensor_factor=v.gains,
        )
        density = rig.fluid.density
        for k, (a, d) in enumerate(zip(v.wave_speeds, v.diameters)):
            network.series[k] = series_impedance(
                self.s, density=density, viscosity=v.viscosity, diameter=d, friction=twin.friction
            )
            network.shunt[k] = shunt_admittance(self.s, density=density, wave_speed=a, diameter=d)
        network.shunt *= self._softness(coordinates)
        line = self.line_state(v)
        for effect, place, own in twin.applied_effects(coordinates):
            own = {name: x[:, None] for name, x in own.items()}
            if "position" in own:
                own["position"] = own["position"][0, 0]
            effect.apply(network, line, own, place)
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
            source_flow=flat(base.source_flow),
            source_admittance=flat(network.source_admittance),
            source_impedance=flat(network.source_impedance),
            inserts=[(x, kind, flat(y)) for x, kind, y in network.inserts],
            sensor_positions=v.positions,
        )
        p, q = network.load_state()
        side_by_side.load = "state", (flat(p), flat(q))
        if base.outflows is not None:
            at, outflow = base.outflows
            side_by_side.outflows = at, np.tile(outflow, count)
        if self.load.orifice is not None:
            side_by_side.load_outflow = flat(v.load * self._remainder)
        readings = side_by_side.readings().reshape(-1, *shape)
        return readings * np.broadcast_to(network.sensor_factor, readings.shape)
