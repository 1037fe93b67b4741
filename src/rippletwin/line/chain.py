"""The line in the frequency domain: a source, segments in a row, inserts between them, a load.

`Network` is a mutable description at given s: the effects of `rippletwin.effects` change its
arrays and append inserts, then it is asked for pressures, impedances or transfer matrices.

Every answer comes from one sweep from the load to the pump in wave variables. Inside a segment

    p = f + b,   q = (f - b)/Zc,   gamma = sqrt(Z'Y'),   Zc = gamma/Y'

and a step of length d towards the pump multiplies f by exp(gamma d) and b by exp(-gamma d).
The growing factor is taken out of both and put back as decay from the pump to the load, so
nothing overflows however strong the loss, and only ratios of like-sized numbers are formed.
(Transfer matrices of such lines: Wylie & Streeter 1993, Fluid Transients in Systems, ch. 12.)
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

LOADS = ("open", "closed", "anechoic", "impedance", "admittance", "state")


class Insert(NamedTuple):
    """A lumped element at `position` (m): a "shunt" admittance or a "series" impedance, (F,)."""

    position: float
    kind: str
    immittance: np.ndarray


@dataclass
class Network:
    """Source, line and load at the F values of `s`; SI units, peak amplitudes.

    s                  (F,) 1/s, not zero
    lengths            (n,) m, pump first
    series, shunt      (n, F) Z' in Pa s/m4 and Y' in m2/(Pa s) of each segment
    source_flow        (F,) or scalar, m3/s, of the ideal flow source at x = 0
    source_admittance  (F,) or scalar, m3/(Pa s), parallel to that source
    load               ("open" | "closed" | "anechoic", None), ("impedance", Z), ("admittance", Y)
                       or ("state", (p, q)): the ratio p:q at the load, in any scale
    inserts            list of Insert or of like tuples; those at one position are met in list
                       order from pump to load
    sensor_positions   (S,) m from the pump outlet
    sensor_factor      (S, F) or broadcastable: what a sensor reads over the pressure at it
    """

    s: np.ndarray
    lengths: np.ndarray
    series: np.ndarray
    shunt: np.ndarray
    source_flow: np.ndarray | complex = 1.0
    source_admittance: np.ndarray | complex = 0.0
    load: tuple = ("closed", None)
    inserts: list = field(default_factory=list)
    sensor_positions: np.ndarray = ()
    sensor_factor: np.ndarray | complex = 1.0

    @property
    def length(self) -> float:
        """Length of the whole line, m."""
        return float(np.sum(self.lengths))

    def readings(self) -> np.ndarray:
        """What the sensors read, (S, F) Pa: pressure at them times `sensor_factor`."""
        return self.pressure_at(self.sensor_positions) * self.sensor_factor

    def pressure_at(self, positions: np.ndarray) -> np.ndarray:
        """Pressure at `positions` (S,), m, in any order: (S, F) Pa.

        Beside an insert it is the value on the pump's side. Raises ValueError outside the line.
        """
        return self._respond(positions)[0]

    def flow_at(self, positions: np.ndarray) -> np.ndarray:
        """Flow towards the load at `positions` (S,): (S, F) m3/s; beside an insert, pump's side."""
        return self._respond(positions)[1]

    def input_impedance(self) -> np.ndarray:
        """p/q at x = 0 looking at the line, (F,) Pa s/m3, inserts at x = 0 included."""
        p, q, _ = self._sweep(*self.load_state(), ())
        return p[-1] / q[-1]

    def load_state(self) -> tuple[np.ndarray | complex, np.ndarray | complex]:
        """A pair (p, q) in the load's ratio, each (F,) or scalar."""
        kind, value = self.load
        if kind == "open":
            return 0.0, 1.0
        if kind == "closed":
            return 1.0, 0.0
        if kind == "anechoic":
            return np.sqrt(self.series[-1] / self.shunt[-1]), 1.0
        if kind == "impedance":
            return value, 1.0
        if kind == "admittance":
            return 1.0, value
        if kind == "state":
            return value
        raise ValueError(f"load must be one of {LOADS}, not {kind!r}")

    def load_relation(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(a, b, c), each (F,), with a p + b q = c at the load, whatever the load is.

        This is Thévenin's theorem without its division, so it holds at resonance too.
        """
        sweep = self._sweep(*_UNIT_STATES)
        a, b = sweep.flow + self.source_admittance * sweep.pressure
        return a, b, self.source_flow * sweep.decay

    def thevenin_at_load(self) -> tuple[np.ndarray, np.ndarray]:
        """Open-circuit pressure (F,) Pa and source impedance (F,) Pa s/m3 seen by the load."""
        a, b, c = self.load_relation()
        return c / a, b / a

    def transfer(self, start: float = 0.0, stop: float | None = None) -> np.ndarray:
        """Matrix T (F, 2, 2) with [p, q](start) = T [p, q](stop), start <= stop, det T = 1.

        Inserts at `start` are inside; those at `stop` only where it is the end of the line (the
        default), so that T(0, x) T(x, l) = T(0, l). The elements grow as exp(gamma l): under
        strong loss ask `pressure_at`, which does not form them.
        """
        end = self.length
        stop = end if stop is None else stop
        edges = np.clip(np.concatenate([[0.0], np.cumsum(self.lengths)]), start, stop)
        inserts = [i for i in self.inserts if start <= i[0] < stop or i[0] == stop == end]
        part = Network(
            s=self.s,
            lengths=np.diff(edges),
            series=self.series,
            shunt=self.shunt,
            inserts=[(x - start, kind, value) for x, kind, value in inserts],
        )
        sweep = part._sweep(*_UNIT_STATES)
        matrix = np.stack([sweep.pressure, sweep.flow]) / sweep.decay  # (row, column, F)
        return np.moveaxis(matrix, 2, 0)

    def _respond(self, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Pressure and flow (S, F) at `positions` with the network's own source and load."""
        sweep = self._sweep(*self.load_state(), positions)
        scale = self.source_flow / (sweep.flow + self.source_admittance * sweep.pressure)
        shape = (len(positions), len(self.s))
        pressure, flow = np.empty(shape, complex), np.empty(shape, complex)
        for (index, p, q), decay in zip(reversed(sweep.stops), reversed(sweep.decays)):
            scale = scale * decay
            pressure[index] = p * scale
            flow[index] = q * scale
        return pressure, flow

    def _sweep(self, p, q, positions=()) -> _Sweep:
        """Carry the state (p, q) at the load, broadcastable to (..., F), up to x = 0."""
        gamma = np.sqrt(self.series * self.shunt)
        impedance = gamma / self.shunt  # on gamma's branch of the root
        starts = np.cumsum(self.lengths) - self.lengths
        here = self.length
        # From load to pump; at one place inserts (last of the list first) before positions.
        order = [(-x, 0, -k) for k, (x, _, _) in enumerate(self.inserts)]
        order += [(-x, 1, k) for k, x in enumerate(positions)]
        order.sort()
        if order and (order[0][0] < -here * (1 + 1e-12) or order[-1][0] > 0.0):
            raise ValueError(f"a position lies outside the line of {here} m")
        order.append((0.0, 2, 0))

        stops, decays, decay = [], [], 1.0
        k = len(starts) - 1
        zc = impedance[k]
        f, b = _waves(p, q, zc)
        for x, what, index in order:
            x = -x
            while True:
                step = here - max(x, starts[k])
                if step > 0.0:
                    e = np.exp(-step * gamma[k])
                    b = b * (e * e)
                    decay = decay * e
                    here -= step
                if k == 0 or x >= starts[k]:
                    break
                p, q = f + b, (f - b) / zc
                k -= 1
                zc = impedance[k]
                f, b = _waves(p, q, zc)
            p, q = f + b, (f - b) / zc
            if what == 0:
                _, kind, value = self.inserts[-index]
                if kind == "shunt":
                    q = q + value * p
                elif kind == "series":
                    p = p + value * q
                else:
                    raise ValueError(f"an insert is 'shunt' or 'series', not {kind!r}")
                f, b = _waves(p, q, zc)
            else:
                decays.append(decay)
                decay = 1.0
                if what == 1:
                    stops.append((index, p, q))
        return _Sweep(p, q, stops, decays)


class _Sweep(NamedTuple):
    """States met between load and pump, each without the growth since the load."""

    pressure: np.ndarray  # at x = 0
    flow: np.ndarray
    stops: list  # (index of the position, p, q), load first
    decays: list  # exp(-gamma d) from load to first stop, between stops, from last stop to x = 0

    @property
    def decay(self) -> np.ndarray:
        """exp(-gamma d) over the whole line."""
        return np.prod(np.broadcast_arrays(*self.decays), axis=0)


def _waves(p, q, zc):
    """Wave towards the load and wave towards the pump, in units of pressure."""
    zq = zc * q
    return 0.5 * (p + zq), 0.5 * (p - zq)


# Load states (p, q) = (1, 0) and (0, 1), side by side.
_UNIT_STATES = np.array([[1.0], [0.0]]), np.array([[0.0], [1.0]])
