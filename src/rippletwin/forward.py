"""The twin's forward model: all recordings' frequencies side by side in one network.

Made once for a set of observations and called very often, so everything that does not depend on
the parameters is worked out beforehand, and the costly friction functions are kept while their
own parameters stand still (as they do in most columns of a finite-difference Jacobian).

The square-law orifice q = K sqrt(p - p_back) at the load is solved at full amplitude. Its linear
part sits in the network; the harmonics n of what is left couple the harmonics of one recording,

    a p + b (Y p + n(p)) = c,

and are found by repeated substitution. With ripple p and mean pressure drop P, n/(Y p) is about
|p|/(4 P), a per cent or so, hence each pass gains two digits.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from rippletwin.case import FlowRipple
from rippletwin.effects.base import LineState
from rippletwin.line.chain import Network
from rippletwin.line.segment import series_impedance, shunt_admittance

MAX_PASSES, TOLERANCE = 30, 1e-10
ATMOSPHERE = 101325.0  # Pa
LOWEST_DROP = 1e-3  # of the mean pressure drop: below it the orifice law is held, to stay real


def flow_harmonics(ripple: FlowRipple, orders: np.ndarray) -> np.ndarray:
    """Peak complex amplitudes (F,), m3/s, at shaft `orders` (F,); that of order 0 is the mean.

    Angles need not be evenly spaced: the ripple is taken as piecewise linear over the revolution.
    """
    angle = np.deg2rad(np.asarray(ripple.angle_deg, dtype=float))
    count = max(4 * len(angle), 4 * int(np.max(orders, initial=0)))
    even = angle[0] + 2 * np.pi * np.arange(count) / count
    step = np.diff(angle)
    if np.allclose(step, 2 * np.pi / len(angle), rtol=1e-6, atol=0):
        even, flow = angle, np.asarray(ripple.flow, dtype=float)
    else:
        flow = np.interp(even, angle, ripple.flow, period=2 * np.pi)
    spectrum = np.exp(-1j * np.outer(orders, even)) @ flow / len(even)
    return np.where(np.asarray(orders) == 0, spectrum, 2 * spectrum)


class Forward:
    """Predictions for fixed observations: `forward(theta) -> list of (S, F) complex`.

    theta is in the coordinates of `twin.parameters`. Pressures are in Pa (peak); a free source
    has unit flow, its amplitude being the likelihood's business; an observation of the input
    impedance is predicted as the reflection coefficient (1, F), see `reflection`.
    """

    def __init__(self, twin, observations: Sequence):
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
        self.speed_hz = column([np.nan if o.speed_hz is None else o.speed_hz for o in observations])
        self.load_pressure = column([p.load_pressure for p in points])
        self.mean_flow = column([p.mean_flow for p in points])
        self.coefficient = column([p.coefficient for p in points])
        self.source = np.concatenate(
            [
                np.ones(n, complex) if p.ripple is None else flow_harmonics(p.ripple, o.orders)
                for p, o, n in zip(points, self.observations, sizes)
            ]
        )
        self.angle_index = [twin.index.get(f"angle[{o.label}]") for o in self.observations]
        self.back_pressure = rig.load.back_pressure
        self.load_impedance = None
        if rig.load.kind == "impedance":
            self.load_impedance = _interpolate(
                self.frequency_hz, rig.load.frequency_hz, rig.load.impedance
            )
        self._friction = {}
        self._harmonics = None
        if rig.load.kind == "orifice":
            self._harmonics = _Harmonics.of(self.order, self.slices, points)

    def __call__(self, theta: np.ndarray) -> list[np.ndarray]:
        network = self.network(theta)
        pressure = network.readings() if len(network.sensor_positions) else None
        impedance = None
        predicted = []
        for o, part, rows in zip(self.observations, self.slices, self.rows):
            if o.kind == "input_impedance":
                impedance = network.input_impedance() if impedance is None else impedance
                scale = self.twin.reference_impedance(theta, o)
                predicted.append(reflection(impedance[None, part] / scale))
            else:
                predicted.append(pressure[rows, part])
        return predicted

    def network(self, theta: np.ndarray) -> Network:
        """The line with source, effects and load at `theta`; an orifice's ripple is solved."""
        twin, rig = self.twin, self.twin.rig
        v = twin.arrays(theta)
        series = np.array(
            [self._series(k, d, v.viscosity) for k, d in enumerate(v.diameters)], dtype=complex
        )
        shunt = np.array(
            [
                shunt_admittance(self.s, density=rig.fluid.density, wave_speed=a, diameter=d)
                for a, d in zip(v.wave_speeds, v.diameters)
            ]
        )
        source = self.source.copy()
        for part, index in zip(self.slices, self.angle_index):
            if index is not None:
                angle = twin.parameters[index].value(theta[index])
                source[part] *= np.exp(1j * angle * self.order[part])
        network = Network(
            s=self.s,
            lengths=v.lengths,
            series=series,
            shunt=shunt,
            source_flow=source,
            load=self._load(v.load),
            sensor_positions=v.positions,
        )
        if twin.effects:
            line = self._line_state(v)
            for effect, place, values in twin.effect_values(theta):
                effect.apply(network, line, values, place)
        if self._harmonics is not None:
            self._balance(network, v.load)
        return network

    def _line_state(self, v) -> LineState:
        fluid = self.twin.rig.fluid
        resistance = None
        if self.twin.rig.load.kind == "orifice":
            resistance = 1.0 / self._orifice_admittance(v.load)
        return LineState(
            density=fluid.density,
            viscosity=v.viscosity,
            diameters=v.diameters,
            wave_speeds=v.wave_speeds,
            mean_pressure=np.where(np.isnan(self.load_pressure), ATMOSPHERE, self.load_pressure),
            load_resistance=resistance,
            heat_capacity_ratio=fluid.heat_capacity_ratio,
            prandtl=fluid.prandtl,
        )

    def _orifice_admittance(self, factor: float) -> np.ndarray:
        """dq/dp of the orifice at the mean pressures, (F,) m3/(Pa s)."""
        return factor * self.coefficient / (2 * np.sqrt(self.load_pressure - self.back_pressure))

    def _series(self, segment: int, diameter: float, viscosity: float) -> np.ndarray:
        last, value = self._friction.get(segment, (None, None))
        if last != (diameter, viscosity):
            value = series_impedance(
                self.s,
                density=self.twin.rig.fluid.density,
                viscosity=viscosity,
                diameter=diameter,
                friction=self.twin.friction,
            )
            self._friction[segment] = (diameter, viscosity), value
        return value

    def _load(self, factor: float) -> tuple:
        kind = self.twin.rig.load.kind
        if kind == "orifice":
            return "admittance", self._orifice_admittance(factor)
        if kind == "impedance":
            return "impedance", factor * self.load_impedance
        return kind, None

    def _balance(self, network: Network, factor: float) -> None:
        """Put the orifice's full-amplitude state at the load of `network`.

        An effect may have changed the load: its change of the linear part is kept, its place as
        the orifice's own admittance too.
        """
        kind, value = network.load
        if kind == "state":
            return
        if kind != "admittance":
            p, q = network.load_state()
            value = q / p
        a, b, c = network.load_relation()
        total = a + b * value
        remainder = np.zeros_like(c)
        p = c / total
        for _ in range(MAX_PASSES):
            remainder = self._harmonics.remainder(p, factor, self.back_pressure)
            new = (c - b * remainder) / total
            change = np.max(np.abs(new - p)) / np.max(np.abs(new))
            p = new
            if change < TOLERANCE:
                break
        network.load = "state", (p, value * p + remainder)


class _Harmonics:
    """The harmonics of each recording with a periodic orifice, as rows of one padded array."""

    def __init__(self, columns, row, harmonic, count, pressure, coefficient):
        self.columns, self.row, self.harmonic = columns, row, harmonic
        self.pressure, self.coefficient = pressure[:, None], coefficient[:, None]
        top = int(harmonic.max())
        samples = 1 << int(np.ceil(np.log2(4 * top + 4)))
        phase = 2j * np.pi * np.outer(np.arange(1, top + 1), np.arange(samples)) / samples
        self.synthesis = np.exp(phase)
        self.analysis = 2 / samples * np.exp(-phase).T
        self.shape = count, top

    @classmethod
    def of(cls, order, slices, points):
        """None where no observation is periodic (the linear orifice is then all there is)."""
        columns, row, harmonic, kept = [], [], [], []
        for part, point in zip(slices, points):
            if point.ripple is None:
                continue
            orders = order[part].astype(int)
            columns.append(np.arange(part.start, part.stop))
            row.append(np.full(len(orders), len(kept)))
            harmonic.append(orders // np.gcd.reduce(orders))
            kept.append(point)
        if not kept:
            return None
        return cls(
            np.concatenate(columns),
            np.concatenate(row),
            np.concatenate(harmonic),
            len(kept),
            np.array([p.load_pressure for p in kept]),
            np.array([p.coefficient for p in kept]),
        )

    def remainder(self, p, factor, back_pressure):
        """Harmonics (F,) of K sqrt(P + p(t)) - Y p(t), the orifice without its linear part."""
        padded = np.zeros(self.shape, complex)
        padded[self.row, self.harmonic - 1] = p[self.columns]
        drop = self.pressure - back_pressure
        ripple = (padded @ self.synthesis).real
        flow = factor * self.coefficient * np.sqrt(np.maximum(drop + ripple, LOWEST_DROP * drop))
        flow -= factor * self.coefficient / (2 * np.sqrt(drop)) * ripple
        result = np.zeros_like(p)
        result[self.columns] = (flow @ self.analysis)[self.row, self.harmonic - 1]
        return result


def reflection(impedance: np.ndarray) -> np.ndarray:
    """R = (z - 1)/(z + 1) of an impedance z over its reference, same shape.

    |R| <= 1 for anything passive. An impedance runs over orders of magnitude between resonance
    and antiresonance, and its error with it; that of R is about the same at all frequencies,
    because R is what a wave brings back: the quantity the line itself is linear in.
    """
    return (impedance - 1.0) / (impedance + 1.0)


def _rows(observation, names: list[str]) -> list[int]:
    """Which of the rig's sensors an observation has."""
    if observation.kind == "input_impedance" or observation.sensors is None:
        return list(range(len(names)))
    return [names.index(getattr(s, "name", s)) for s in observation.sensors]


def _interpolate(at, frequency_hz, values):
    return np.interp(at, frequency_hz, values.real) + 1j * np.interp(at, frequency_hz, values.imag)
