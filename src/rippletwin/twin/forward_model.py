"""The twin's forward model: the frequencies of all observations side by side in one line.

It is made once for a set of observations and called very often. What does not depend on the
parameters is calculated once, and the costly friction functions are cached while their own
parameters do not change (as in most columns of a finite-difference Jacobian).
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from rippletwin.line.frequency_domain.line_network import FrequencyDomainLine, LoadBalance
from rippletwin.line.frequency_domain.nonlinear_compliance import NonlinearComplianceSolver
from rippletwin.line.frequency_domain.pipe_immittance import series_impedance, shunt_admittance
from rippletwin.twin.effects.base import LineState
from rippletwin.twin.flow_source import FlowSource
from rippletwin.twin.line_load import LineLoad
from rippletwin.twin.reflection import reference_impedance, to_reflection

if TYPE_CHECKING:
    from rippletwin.twin.twin import Arrays, Twin

COUPLED_ORIFICE_TOLERANCE = 1e-4  # of its pressure, while outflows are known to no better
COMPLIANCE_BAND = 3.0  # simulated band over the observed one: nonlinear compliance couples down
ORIFICE_HARMONICS = 3  # simulated above the highest observed: an orifice couples neighbours


class ForwardModel:
    """Predictions for fixed observations: `forward(theta) -> list of (S, F) complex`.

    theta is in the coordinates of `twin.parameters`. Pressures are in Pa (peak). A free source has
    unit flow; the likelihood estimates its amplitude. An input impedance is predicted as the
    reflection coefficient (1, F), see `twin.reflection`.

    observations may be `OperatingCondition`s. `slices` has each one's columns among all F; `solved`
    says whether orifice and nonlinear compliance of the last prediction are in a steady state;
    `amplitude` (F,) is what is known of the source over the nominal one.
    """

    def __init__(self, twin: Twin, observations: Sequence):
        self.twin = twin
        self.observations = list(observations)
        rig = twin.rig
        sizes = [len(o.frequency_hz) for o in self.observations]
        edges = np.concatenate([[0], np.cumsum(sizes)])
        self.slices = [slice(a, b) for a, b in pairwise(edges)]
        self.frequency_hz = np.concatenate([o.frequency_hz for o in self.observations])
        self.s = 2j * np.pi * self.frequency_hz
        names = [sensor.name for sensor in rig.sensors]
        self.rows = [_rows(o, names) for o in self.observations]

        def column(values):
            return np.repeat(np.asarray(values, dtype=float), sizes)

        self.recording = np.repeat(np.arange(len(sizes)), sizes)
        self.order = np.concatenate(
            [np.zeros(n) if o.orders is None else o.orders for o, n in zip(observations, sizes)]
        )
        points = [twin.operating_point(o) for o in self.observations]
        self.mean_flow = column([p.mean_flow for p in points])
        self._mean_pressure = np.nan_to_num(column([p.load_pressure for p in points]))
        self.source = FlowSource(twin, self.observations, points, self.slices)
        self.load = LineLoad(rig, self.frequency_hz, points, self.slices, self.order)
        self._series_cache: dict[int, tuple] = {}
        self._ripples = [point.ripple for point in points]
        self._periodic = [r for r, ripple in enumerate(self._ripples) if ripple is not None]
        self.amplitude = self._known_amplitude()
        self.solved = True
        self._last_linear: tuple[bytes, FrequencyDomainLine] | None = None
        # The line before its last effect: many predictions differ in the last effect alone.
        self._before_last: tuple[bytes, FrequencyDomainLine, LineState] | None = None
        periodic = [self.slices[r] for r in self._periodic]
        self.compliance_solver = NonlinearComplianceSolver(periodic, self.order)

    def __call__(self, theta: np.ndarray) -> list[np.ndarray]:
        network, balance = self._solve(theta)
        return self._read(network, theta, balance and balance.readings)

    def _known_amplitude(self) -> np.ndarray:
        """(F,) by which the ripple of each recording is multiplied where load and compliance are
        nonlinear, what is known of it over the nominal one; 1 where nothing is."""
        amplitude = np.ones(len(self.s), complex)
        for o, part in zip(self.observations, self.slices):
            known = getattr(o, "corrected_ripple", None)
            if known is not None and o.orders is not None:
                amplitude[part] = known.at(o.label, np.asarray(o.orders))
        return amplitude

    def unit_response(self, theta: np.ndarray) -> list[np.ndarray]:
        """Predictions, list of (S, F), Pa s/m3, at theta (P,) for a unit flow at every frequency,
        in the shaft's frame, and a ripple so small that load and line are linear."""
        network = self._linear(theta)
        network.source_flow = self.source.turn(theta)
        return self._read(network, theta)

    def _read(
        self, network: FrequencyDomainLine, theta: np.ndarray, pressure: np.ndarray | None = None
    ) -> list[np.ndarray]:
        """What each observation reads of `network`, (S, F); `pressure` are its readings where they
        are known."""
        if pressure is None and len(network.sensor_positions):
            pressure = network.readings()
        impedance = None
        predicted = []
        for o, part, rows in zip(self.observations, self.slices, self.rows):
            if o.kind == "input_impedance":
                impedance = network.input_impedance() if impedance is None else impedance
                scale = reference_impedance(self.twin, theta, o)
                predicted.append(to_reflection(impedance[None, part] / scale))
            else:
                predicted.append(pressure[rows, part])
        return predicted

    @cached_property
    def has_nonlinear_compliance(self) -> bool:
        """Whether the line has a pressure-dependent compliance that a ripple excites."""
        return bool(self._periodic and self._linear(self.twin.theta).nonlinear_compliances)

    def network(self, theta: np.ndarray) -> FrequencyDomainLine:
        """The line with source, effects and load at `theta` (P,); nonlinear load and compliance are
        solved at full amplitude."""
        return self._solve(theta)[0]

    def _solve(self, theta: np.ndarray) -> tuple[FrequencyDomainLine, LoadBalance | None]:
        """`network`, and what was found with the state at its load."""
        whole = balance = None
        if self.load.orifice is not None and self._orifice_is_exact:
            wide, seen = self._extended_for_orifice
            whole = wide._linear(theta)
            network = whole.at_frequencies(seen)
            self._last_linear = np.asarray(theta, float).tobytes(), copy(network)
        else:
            network = self._linear(theta)
        if self.load.orifice is not None or (network.nonlinear_compliances and self._periodic):
            balance = self._balance(network, theta, whole)
        return network, balance

    @property
    def _orifice_is_exact(self) -> bool:
        """Whether the orifice alone is solved with harmonics above those observed."""
        return not self.has_nonlinear_compliance

    def _linear(self, theta: np.ndarray) -> FrequencyDomainLine:
        """The same line for a small ripple; that of the last theta is kept."""
        key = np.asarray(theta, float).tobytes()
        if self._last_linear is None or self._last_linear[0] != key:
            self._last_linear = key, self._make_linear(theta)
        return copy(self._last_linear[1])

    def _make_linear(self, theta: np.ndarray) -> FrequencyDomainLine:
        if not self.twin.effects:
            return self._make_bare(theta, self.arrays(theta))
        without = np.array(theta, float)
        without[self.twin.last_parameters] = 0.0
        key = without.tobytes()
        if self._before_last is None or self._before_last[0] != key:
            v = self.arrays(theta)
            network, line = self._make_bare(theta, v), self.line_state(v)
            for effect, place, values in self.twin.applied_effects(theta)[:-1]:
                effect.apply(network, line, values, place)
            self._before_last = key, network, line
        _, network, line = self._before_last
        network = network.separate()
        effect, place, values = self.twin.last_applied(theta)
        effect.apply(network, line, values, place)
        return network

    def _make_bare(self, theta: np.ndarray, v: Arrays) -> FrequencyDomainLine:
        """The line for a small ripple without effects, with `v` of `arrays`."""
        rig = self.twin.rig
        series = np.array(
            [self._series(k, d, v.viscosity) for k, d in enumerate(v.diameters)], dtype=complex
        )
        shunt = self._softness(theta) * shunt_admittance(
            self.s,
            density=rig.fluid.density,
            wave_speed=v.wave_speeds[:, None],
            diameter=v.diameters[:, None],
        )
        source, source_admittance = self.source.at(theta)
        return FrequencyDomainLine(
            s=self.s,
            lengths=v.lengths,
            series=series,
            shunt=shunt,
            source_flow=source * self.source.turn(theta),
            source_admittance=source_admittance,
            load=self.load.linear_relation(v),
            sensor_positions=v.positions,
            sensor_factor=v.gains,
        )

    def _states(self, theta: np.ndarray) -> np.ndarray:
        """Factor (..., R) on the wave speeds while each of R recordings was made; `theta` may be
        (P, B)."""
        factors = np.ones((*np.shape(theta)[1:], len(self.observations)))
        for r, o in enumerate(self.observations):
            k = self.twin.index.get(f"state[{o.label}]")
            if k is not None:
                factors[..., r] = self.twin.parameters[k].value(theta[k])
        return factors

    def _softness(self, theta: np.ndarray) -> np.ndarray | float:
        """What the state of each recording makes of shunt admittances, (..., F)."""
        if not self.twin.changing_state:
            return 1.0
        return (self._states(theta) ** -2.0)[..., self.recording]

    def arrays(self, theta: np.ndarray) -> Arrays:
        """`Twin.arrays` at theta (P,), with the viscosity (F,) while each recording was made."""
        return self._as_recorded(theta, self.twin.arrays(theta))

    def _as_recorded(self, theta: np.ndarray, v: Arrays) -> Arrays:
        """`v` with the viscosity (..., F) while each recording was made; `theta` may be (P, B).

        What all recordings have in common is in the viscosity itself: a state would take a part of
        its error, and move wave speeds with it.
        """
        twin = self.twin
        if not twin.changing_state:
            return v
        k = twin.index["viscosity_slope"]
        slope = np.asarray(twin.parameters[k].value(theta[k]))[..., None]
        known = [twin.index[f"state[{label}]"] for label in twin.reference or twin.labels]
        mean = np.exp(np.mean([np.log(twin.parameters[i].value(theta[i])) for i in known], axis=0))
        about_mean = self._states(theta) / mean[..., None]
        return v._replace(viscosity=v.viscosity * (about_mean**slope)[..., self.recording])

    def line_state(self, v: Arrays) -> LineState:
        """The numbers of the line that effects need, with `v` of `arrays`."""
        fluid = self.twin.rig.fluid
        resistance = None
        if self.twin.rig.load.kind == "orifice":
            resistance = 1.0 / self.load.orifice_admittance(v.load)
        return LineState(
            density=fluid.density,
            viscosity=v.viscosity,
            diameters=v.diameters,
            wave_speeds=v.wave_speeds,
            lengths=v.lengths,
            mean_pressure=self._mean_pressure,
            load_resistance=resistance,
            heat_capacity_ratio=fluid.heat_capacity_ratio,
            prandtl=fluid.prandtl,
            orders=self.order,
            recording=self.recording,
            mean_flow=self.mean_flow,
            load_passes_flow=self.twin.rig.load.passes_flow and not self.twin.guessed_load,
            friction=self.twin.friction_law,
            effects=self.twin.effects,
        )

    def _series(self, segment: int, diameter: float, viscosity: np.ndarray | float) -> np.ndarray:
        key = diameter, np.asarray(viscosity).tobytes()
        last, value = self._series_cache.get(segment, (None, None))
        if last != key:
            value = series_impedance(
                self.s,
                density=self.twin.rig.fluid.density,
                viscosity=viscosity,
                diameter=diameter,
                friction=self.twin.friction,
            )
            self._series_cache[segment] = key, value
        return value

    def _balance(
        self, network: FrequencyDomainLine, theta: np.ndarray, whole: FrequencyDomainLine | None
    ) -> LoadBalance | None:
        """Set the full-amplitude state at the load of `network`, and its outflows; returns what was
        found with that state where one sweep gives all of it.

        Both are solved in a model with harmonics above those observed; `whole` is its line where
        only the orifice is nonlinear.
        """
        if whole is None:
            wide, seen = self._extended_for_compliance
            whole = wide._linear(theta)
            whole.source_flow = np.array(whole.source_flow)
            whole.source_flow[seen] = network.source_flow
            whole.source_flow *= wide.amplitude
            solver = wide.compliance_solver
            tolerance = min(COUPLED_ORIFICE_TOLERANCE, solver.tolerance)
            solve_load = wide.load.make_solver(
                whole, self.twin.load_factor(theta), tolerance=tolerance
            )
            state = [x[seen] / self.amplitude for x in solver.solve(whole, solve_load)]
            self.solved = solver.solved and wide.load.solved
            positions, outflow = whole.outflows
            network.outflows = positions, outflow[:, seen] / self.amplitude
            if self.load.orifice is not None:
                network.load = "state", tuple(state)
            return None
        wide, seen = self._extended_for_orifice
        whole.source_flow = whole.source_flow * wide.amplitude
        found = wide.load.balance(whole, self.twin.load_factor(theta))
        self.solved = wide.load.solved
        return self._take_balance(network, found, seen)

    def _balance_load(self, network: FrequencyDomainLine, theta: np.ndarray) -> LoadBalance | None:
        """`_balance` of the load alone; the outflows of `network` are given."""
        balance = None
        if self.load.orifice is not None:
            scaled = copy(network)
            scaled.source_flow = network.source_flow * self.amplitude
            if network.outflows is not None:
                positions, outflow = network.outflows
                scaled.outflows = positions, outflow * self.amplitude
            found = self.load.balance(scaled, self.twin.load_factor(theta))
            balance = self._take_balance(network, found, slice(None))
        self.solved = self.load.solved
        return balance

    def _take_balance(
        self, network: FrequencyDomainLine, found: LoadBalance, seen: np.ndarray | slice
    ) -> LoadBalance:
        """Set the load of `network` to the columns `seen` of a balance at the known amplitude of
        the ripple; returns these columns at that of `network`."""
        balance = LoadBalance(*(x[..., seen] / self.amplitude for x in found))
        network.load = "state", (balance.pressure, balance.flow)
        return balance

    @cached_property
    def _extended_for_compliance(self) -> tuple[ForwardModel, np.ndarray]:
        return self._extend(lambda top, step: COMPLIANCE_BAND * top)

    @cached_property
    def _extended_for_orifice(self) -> tuple[ForwardModel, np.ndarray]:
        return self._extend(lambda top, step: top + (ORIFICE_HARMONICS + 0.5) * step)

    def _extend(self, highest) -> tuple[ForwardModel, np.ndarray]:
        """The model with more harmonics of every recording, up to the order `highest` (top order
        observed, step), and the columns of those observed in it."""
        wide = list(self.observations)
        for r in self._periodic:
            o = wide[r]
            step, top = np.gcd.reduce(np.asarray(o.orders, int)), np.max(o.orders)
            most = min(highest(top, step), 0.5 * len(self._ripples[r].angle_deg))
            orders = np.append(o.orders, np.arange(top + step, most, step))
            wide[r] = replace(o, orders=orders, frequency_hz=orders * o.speed_hz)
        forward = ForwardModel(self.twin, wide)
        own = [np.r_[b][: a.stop - a.start] for a, b in zip(self.slices, forward.slices)]
        return forward, np.concatenate(own)


def _rows(observation, names: list[str]) -> list[int]:
    """Indices of an observation's sensors among the rig's."""
    if observation.kind == "input_impedance" or observation.sensors is None:
        return list(range(len(names)))
    return [names.index(getattr(s, "name", s)) for s in observation.sensors]
