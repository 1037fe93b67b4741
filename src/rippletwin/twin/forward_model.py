"""The twin's forward model: what the sensors read, with the nonlinear load and compliance solved.

Both couple harmonics, and are solved in a model with all harmonics of the pump, also above those
observed.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from rippletwin.line.frequency_domain.line_network import FrequencyDomainLine, LoadBalance
from rippletwin.line.frequency_domain.nonlinear_compliance import NonlinearComplianceSolver
from rippletwin.twin.reflection import reference_impedance, to_reflection
from rippletwin.twin.small_ripple_line import SmallRippleLine

if TYPE_CHECKING:
    from rippletwin.twin.twin import Twin

COUPLED_ORIFICE_TOLERANCE = 1e-4  # of its pressure, while outflows are known to no better
COMPLIANCE_BAND = 3.0  # simulated band over the observed one: nonlinear compliance couples down
ORIFICE_HARMONICS = 3  # simulated above the highest observed: an orifice couples neighbours


class ForwardModel(SmallRippleLine):
    """Predictions for fixed observations: `forward(theta) -> list of (S, F) complex`.

    theta is in the coordinates of `twin.parameters`. Pressures are in Pa (peak). A free source has
    unit flow; the likelihood estimates its amplitude. An input impedance is predicted as the
    reflection coefficient (1, F), see `twin.reflection`.

    `solved` says whether orifice and nonlinear compliance of the last prediction are in a steady
    state; `amplitude` (F,) is what is known of the source over the nominal one.
    """

    def __init__(self, twin: Twin, observations: Sequence):
        super().__init__(twin, observations)
        names = [sensor.name for sensor in twin.rig.sensors]
        self.rows = [_rows(o, names) for o in self.observations]
        self._ripples = [point.ripple for point in self._points]
        self._periodic = [r for r, ripple in enumerate(self._ripples) if ripple is not None]
        self.amplitude = self._known_amplitude()
        self.solved = True
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
            self._keep_linear(theta, network)
        else:
            network = self._linear(theta)
        if self.load.orifice is not None or (network.nonlinear_compliances and self._periodic):
            balance = self._balance(network, theta, whole)
        return network, balance

    @property
    def _orifice_is_exact(self) -> bool:
        """Whether the orifice alone is solved with all harmonics."""
        return not self.has_nonlinear_compliance

    def _balance(
        self, network: FrequencyDomainLine, theta: np.ndarray, whole: FrequencyDomainLine | None
    ) -> LoadBalance | None:
        """Set the full-amplitude state at the load of `network`, and its outflows; returns what was
        found with that state where one sweep gives all of it.

        Both are solved in a model with all harmonics; `whole` is its line where only the orifice is
        nonlinear.
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
        """The model with all harmonics of every recording, up to the order `highest` (top order
        observed, step), and the columns of those observed in it.

        Those below and between the observed ones are there too: a band or a part of it that is
        left out of a fit is still in the pump's ripple.
        """
        wide = list(self.observations)
        observed = [np.arange(part.stop - part.start) for part in self.slices]
        for r in self._periodic:
            o = wide[r]
            own, top = np.asarray(o.orders, int), np.max(o.orders)
            step = np.gcd.reduce([*own, self.twin.rig.pump["pistons"]])
            most = min(highest(top, step), self._ripples[r].highest_order + 0.5)
            orders = np.union1d(own, np.arange(step, most, step))
            wide[r] = replace(o, orders=orders, frequency_hz=orders * o.speed_hz)
            observed[r] = np.searchsorted(orders, own)
        forward = ForwardModel(self.twin, wide)
        columns = [part.start + own for part, own in zip(forward.slices, observed)]
        return forward, np.concatenate(columns)


def _rows(observation, names: list[str]) -> list[int]:
    """Indices of an observation's sensors among the rig's."""
    if observation.kind == "input_impedance" or observation.sensors is None:
        return list(range(len(names)))
    return [names.index(getattr(s, "name", s)) for s in observation.sensors]
