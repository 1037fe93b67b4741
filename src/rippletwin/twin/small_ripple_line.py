"""The twin's line for a small ripple: the frequencies of all observations side by side.

It is made once for a set of observations and called very often. What does not depend on the
parameters is calculated once, and the costly friction functions are cached while their own
parameters do not change (as in most columns of a finite-difference Jacobian).
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from rippletwin.line.frequency_domain.line_network import FrequencyDomainLine
from rippletwin.line.frequency_domain.pipe_immittance import series_impedance, shunt_admittance
from rippletwin.twin.effects.base import LineState
from rippletwin.twin.flow_source import FlowSource
from rippletwin.twin.line_load import LineLoad

if TYPE_CHECKING:
    from rippletwin.twin.twin import Arrays, Twin


class SmallRippleLine:
    """The line of fixed observations with source, effects and a linear load, at any theta.

    theta is in the coordinates of `twin.parameters`. observations may be `OperatingCondition`s.
    `slices` has each one's columns among all F; `order` (F,) are shaft orders, 0 where there are
    none; `recording` (F,) is the observation that a column belongs to.
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

        def column(values):
            return np.repeat(np.asarray(values, dtype=float), sizes)

        self.recording = np.repeat(np.arange(len(sizes)), sizes)
        self.order = np.concatenate(
            [np.zeros(n) if o.orders is None else o.orders for o, n in zip(observations, sizes)]
        )
        points = self._points = [twin.operating_point(o) for o in self.observations]
        self.mean_flow = column([p.mean_flow for p in points])
        self._mean_pressure = np.nan_to_num(column([p.load_pressure for p in points]))
        self.source = FlowSource(twin, self.observations, points, self.slices)
        self.load = LineLoad(rig, self.frequency_hz, points, self.slices, self.order)
        self._series_cache: dict[int, tuple] = {}
        self._last_linear: tuple[bytes, FrequencyDomainLine] | None = None
        # The line before its last effect: many predictions differ in the last effect alone.
        self._before_last: tuple[bytes, FrequencyDomainLine, LineState] | None = None

    def _linear(self, theta: np.ndarray) -> FrequencyDomainLine:
        """The line at theta (P,); that of the last theta is kept."""
        key = np.asarray(theta, float).tobytes()
        if self._last_linear is None or self._last_linear[0] != key:
            self._last_linear = key, self._make_linear(theta)
        return copy(self._last_linear[1])

    def _keep_linear(self, theta: np.ndarray, network: FrequencyDomainLine) -> None:
        """Let `_linear` at theta (P,) be `network`."""
        self._last_linear = np.asarray(theta, float).tobytes(), copy(network)

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
        """The line without effects, with `v` of `arrays`."""
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
