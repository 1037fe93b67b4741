"""The line in the frequency domain: a source, segments in a row, inserts between them, a load.

`FrequencyDomainLine` is a mutable description at given s: the effects of
`rippletwin.twin.effects` change its arrays and append inserts; then it is asked for pressures,
impedances or transfer matrices.

Every result comes from one sweep from the load to the pump in wave variables. Inside a segment

    p = f + b,   q = (f - b)/Zc,   gamma = sqrt(Z'Y'),   Zc = gamma/Y'

and a step of length d towards the pump multiplies f by exp(gamma d) and b by exp(-gamma d). Both
are divided by the growing factor, and the factors are restored as a decay from the pump to the
load: nothing overflows however large the loss, and only numbers of like size are divided.
(Transfer matrices of such lines: Wylie & Streeter 1993, Fluid Transients in Systems, ch. 12.)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from rippletwin.line.frequency_domain.line_sweep import (
    OUTFLOW,
    RECORD,
    SERIES,
    SHUNT,
    order_steps,
    sweep_line,
)

INSERTS = {"shunt": SHUNT, "series": SERIES}
LOADS = ("open", "closed", "anechoic", "impedance", "admittance", "state")


class Insert(NamedTuple):
    """A lumped element at `position` (m): a "shunt" admittance or a "series" impedance, (F,)."""

    position: float
    kind: str
    immittance: np.ndarray


class LoadBalance(NamedTuple):
    """Pressure (F,), Pa, and flow (F,), m3/s, at a load; what the sensors then read, (S, F) Pa, and
    what they would read if the load were linear."""

    pressure: np.ndarray
    flow: np.ndarray
    readings: np.ndarray
    linear_readings: np.ndarray


@dataclass
class FrequencyDomainLine:
    """Source, line and load at the F values of `s`; SI units, peak amplitudes.

    s                  (F,) 1/s, not zero
    lengths            (n,) m, pump first
    series, shunt      (n, F) Z' in Pa s/m4 and Y' in m2/(Pa s) of each segment
    source_flow        (F,) or scalar, m3/s, of the ideal flow source at x = 0
    source_admittance  (F,) or scalar, m3/(Pa s), parallel to that source
    source_impedance   (F,) or scalar, Pa s/m3, in series between the two and x = 0: the pump's own
                       passage, behind which the line begins
    load               ("open" | "closed" | "anechoic", None), ("impedance", Z), ("admittance", Y)
                       or ("state", (p, q)): the ratio p:q at the load, in any scale
    inserts            list of Insert or of like tuples; those at one position follow each other in
                       list order from pump to load
    sensor_positions   (S,) m from the pump outlet
    sensor_factor      (S, F) or broadcastable: what a sensor reads over the pressure at it
    opening            (F,) of a valve at the load that follows the pressure, see `OrificeLoad`; its
                       effect on a small ripple is an insert
    nonlinear_compliances   list of `NonlinearCompliance`, for the ripple at full amplitude
    outflows           (positions (N,), flows (N, F)) that leave the line whatever the pressure, for
                       lines that the ripple passes: with them no scale can be taken out
    load_outflow       (F,) flow that passes the load whatever the pressure, besides what its ratio
                       says; `respond` alone heeds it
    """

    s: np.ndarray
    lengths: np.ndarray
    series: np.ndarray
    shunt: np.ndarray
    source_flow: np.ndarray | complex = 1.0
    source_admittance: np.ndarray | complex = 0.0
    source_impedance: np.ndarray | complex = 0.0
    load: tuple = ("closed", None)
    inserts: list = field(default_factory=list)
    sensor_positions: np.ndarray | Sequence[float] = ()
    sensor_factor: np.ndarray | complex = 1.0
    opening: np.ndarray | None = None
    nonlinear_compliances: list = field(default_factory=list)
    outflows: tuple | None = None
    load_outflow: np.ndarray | None = None

    @property
    def length(self) -> float:
        """Length of the whole line, m."""
        return float(np.sum(self.lengths))

    def separate(self) -> FrequencyDomainLine:
        """The same line with arrays and lists of its own, which effects may change."""
        return replace(
            self,
            series=np.array(self.series),
            shunt=np.array(self.shunt),
            source_flow=np.array(self.source_flow),
            source_admittance=np.array(self.source_admittance),
            source_impedance=np.array(self.source_impedance),
            inserts=list(self.inserts),
            sensor_factor=np.array(self.sensor_factor),
            nonlinear_compliances=list(self.nonlinear_compliances),
        )

    def at_frequencies(self, which: np.ndarray) -> FrequencyDomainLine:
        """The same line, without nonlinear compliances, at some of its frequencies (their indices,
        (G,))."""

        def at(value):
            return value[..., which] if np.shape(value)[-1:] == np.shape(self.s) else value

        kind, load = self.load
        return replace(
            self,
            s=self.s[which],
            series=self.series[:, which],
            shunt=self.shunt[:, which],
            source_flow=at(self.source_flow),
            source_admittance=at(self.source_admittance),
            source_impedance=at(self.source_impedance),
            load=(kind, tuple(map(at, load)) if kind == "state" else at(load)),
            inserts=[Insert(x, form, at(value)) for x, form, value in self.inserts],
            sensor_factor=at(self.sensor_factor),
            opening=at(self.opening),
            outflows=self.outflows and (self.outflows[0], at(self.outflows[1])),
            load_outflow=at(self.load_outflow),
        )

    def readings(self) -> np.ndarray:
        """What the sensors read, (S, F) Pa: pressure at them times `sensor_factor`."""
        return self.pressure_at(self.sensor_positions) * self.sensor_factor

    def pressure_at(self, positions: np.ndarray | Sequence[float]) -> np.ndarray:
        """Pressure at `positions` (S,), m, in any order: (S, F) Pa.

        Beside an insert it is the value on the pump's side. Raises ValueError outside the line.
        """
        return self.respond(positions)[0]

    def flow_at(self, positions: np.ndarray | Sequence[float]) -> np.ndarray:
        """Flow towards the load at `positions` (S,): (S, F) m3/s; beside an insert, on the pump's
        side."""
        return self.respond(positions)[1]

    def pump_pressure(self) -> np.ndarray:
        """Pressure at the source, (F,) Pa, from which its admittance takes its flow: that at x = 0
        and what falls over `source_impedance`."""
        pressure, flow = self.respond([0.0])
        return pressure[0] + self.source_impedance * flow[0]

    def input_impedance(self) -> np.ndarray:
        """p/q of the source looking at the line, (F,) Pa s/m3; `source_impedance` and inserts at
        x = 0 are included."""
        entry = self.sweep([self.load_state()])[2]
        return entry[0, 0] / entry[0, 1]

    def load_state(self) -> tuple[np.ndarray | complex, np.ndarray | complex]:
        """A pair (p, q) in the load's ratio, each (F,) or scalar. Raises ValueError for an unknown
        kind of load."""
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
        """(a, b, c), each (F,), with a p + b q = c at the load, p in Pa, q in m3/s, whatever the
        load is.

        This is Thévenin's theorem without its division, so it holds at resonance too.
        """
        return self._relate_load(*self.sweep([(1.0, 0.0), (0.0, 1.0)])[2:])

    def _relate_load(self, entry, decay):
        """`load_relation` from what `sweep` gives at the source for the load states (1, 0) and
        (0, 1)."""
        a, b, *forced = entry[:, 1] + self.source_admittance * entry[:, 0]
        return a, b, self.source_flow * decay - sum(forced)

    def balance_load(self, solve_load: Callable) -> LoadBalance:
        """The state at a load of any law, and the readings with it and with the linear `load`.

        `solve_load` maps a, b, c of `load_relation` to pressure and flow at the load. One sweep
        gives both the relation and what each of its two solutions makes at the sensors.
        """
        pressure, _, *at_pump = self.sweep([(1.0, 0.0), (0.0, 1.0)], self.sensor_positions)
        forced = np.sum(pressure[:, 2:], axis=1)
        factor = self.sensor_factor / at_pump[1]

        def read(p, q):
            return factor * (pressure[:, 0] * p + pressure[:, 1] * q + forced)

        a, b, c = self._relate_load(*at_pump)
        p, q = solve_load(a, b, c)
        linear_p, linear_q = self.load_state()
        scale = c / (a * linear_p + b * linear_q)
        return LoadBalance(p, q, read(p, q), read(scale * linear_p, scale * linear_q))

    def thevenin_at_load(self) -> tuple[np.ndarray, np.ndarray]:
        """Open-circuit pressure (F,) Pa and source impedance (F,) Pa s/m3 seen by the load."""
        a, b, c = self.load_relation()
        return c / a, b / a

    def transfer(self, start: float = 0.0, stop: float | None = None) -> np.ndarray:
        """Matrix T (F, 2, 2) with [p, q](start) = T [p, q](stop), start <= stop in m, det T = 1.

        Inserts at `start` are inside; those at `stop` only where it is the end of the line (the
        default), so that T(0, x) T(x, l) = T(0, l). The elements grow as exp(gamma l): under
        strong loss ask `pressure_at`, which does not form them.
        """
        end = self.length
        stop = end if stop is None else stop
        edges = np.clip(np.concatenate([[0.0], np.cumsum(self.lengths)]), start, stop)
        inserts = [i for i in self.inserts if start <= i[0] < stop or i[0] == stop == end]
        part = FrequencyDomainLine(
            s=self.s,
            lengths=np.diff(edges),
            series=self.series,
            shunt=self.shunt,
            inserts=[(x - start, kind, value) for x, kind, value in inserts],
        )
        _, _, entry, decay = part.sweep([(1.0, 0.0), (0.0, 1.0)])
        return (entry / decay).transpose(2, 1, 0)

    def respond(self, positions: np.ndarray | Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
        """Pressure, Pa, and flow, m3/s, (S, F) at `positions`, m, with the network's own source and
        load."""
        return self.respond_with_transfer(positions)[:2]

    def respond_with_transfer(
        self, positions: np.ndarray | Sequence[float]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """`respond`, and the pressure (S, F) at `positions` for each unit that is added to the flow
        of the ideal source, Pa s/m3; what leaves the line whatever the pressure stays."""
        states = [self.load_state()]
        if self.load_outflow is not None:
            states.append((0.0, self.load_outflow))
        pressure, flow, entry, decay = self.sweep(states, positions)
        own, *forced = entry[:, 1] + self.source_admittance * entry[:, 0]
        transfer = pressure[:, 0] / own
        if not forced:
            scale = self.source_flow / own
            return pressure[:, 0] * scale, flow[:, 0] * scale, transfer
        scale = (self.source_flow * decay - sum(forced)) / own
        pressure, flow = (
            (x[:, 0] * scale + np.sum(x[:, 1:], axis=1)) / decay for x in (pressure, flow)
        )
        return pressure, flow, transfer

    def sweep(
        self, states: list, positions: np.ndarray | Sequence[float] = ()
    ) -> tuple[np.ndarray, ...]:
        """Propagate m load states (p, q) to the source: pressure and flow (S, m, F) at the
        positions, the pairs (m, 2, F) at the source, and the decay (F,) of the line.

        Divided by the decay of the whole line, all are in the scale of `states`. Where there are
        outflows, one more state follows: their response with zero pressure and flow at the load.
        """
        count = len(self.s)
        at, outflow = self.outflows or ((), np.empty((0, count), complex))
        load = np.zeros((len(states) + (self.outflows is not None), 2, count), complex)
        for given, (p, q) in zip(load, states):
            given[0], given[1] = p, q
        values = np.empty((len(self.inserts) + 1, count), complex)
        for row, (_, _, value) in zip(values, self.inserts):
            row[:] = value
        values[-1] = self.source_impedance
        return sweep_line(
            np.ascontiguousarray(self.series, complex),
            np.ascontiguousarray(self.shunt, complex),
            self._plan(positions, at),
            values,
            load,
            np.ascontiguousarray(outflow, complex),
            len(positions),
        )

    def _plan(self, positions, outflows) -> np.ndarray:
        """Steps (N, 3) from the load to the source, for `sweep_line`: what, index, distance."""
        inserts = self.inserts[::-1]  # at one place the last comes first, before the positions
        for _, kind, _ in inserts:
            if kind not in INSERTS:
                raise ValueError(f"an insert is 'shunt' or 'series', not {kind!r}")
        what = [INSERTS[kind] for _, kind, _ in inserts]
        at = np.array([*(x for x, _, _ in inserts), *positions, *outflows], float)
        what += [RECORD] * len(positions) + [OUTFLOW] * len(outflows)
        index = [*range(len(inserts))[::-1], *range(len(positions)), *range(len(outflows))]
        lengths = np.asarray(self.lengths, float)
        plan = order_steps(lengths, at, np.array(what, np.int64), np.array(index, np.int64))
        if not len(plan):
            raise ValueError(f"a position lies outside the line of {self.length} m")
        if np.any(self.source_impedance):  # last, so that whatever is at x = 0 is behind it
            plan = np.vstack([plan, [SERIES, len(inserts), 0.0]])
        return plan
