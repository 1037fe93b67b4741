"""The pump as a flow source: harmonics, their dependence on the pump's parameters, shaft angle."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rippletwin.case.model import FlowRipple
from rippletwin.harmonics import flow_harmonics, peak_amplitudes, phase_modulate
from rippletwin.twin.operating_point import OperatingPoint

if TYPE_CHECKING:
    from rippletwin.twin.twin import Twin


OPERATING_STEP = 0.0002
"""Relative distance of the speeds and load pressures at which changes of the pump's ripple are
calculated. The error of the ripple is below a tenth of the least model error."""


class FlowSource:
    """The sources of observations whose frequencies are side by side in `slices`.

    flow        (F,) of the nominal ripple, m3/s, with the pump's parameters at coordinates 0; 1
                where there is none: a free source
    admittance  (F,) of the pump's chambers parallel to it, m3/(Pa s)
    changes     (index, slope and curvature (2, F) of the flow, slope (F,) of the admittance) for
                each of the pump's parameters, by its coordinate
    angles      index in theta of each observation's shaft angle, None for those without
    """

    def __init__(
        self,
        twin: Twin,
        observations: Sequence,
        points: Sequence[OperatingPoint],
        slices: Sequence[slice],
    ):
        self._parameters, self._slices = twin.parameters, slices
        self._orders = [o.orders for o in observations]
        count = slices[-1].stop if slices else 0
        self.flow, self.admittance = np.ones(count, complex), np.zeros(count, complex)
        self.angles = [twin.index.get(f"angle[{o.label}]") for o in observations]
        changes: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        for o, point, part in zip(observations, points, slices):
            if point.ripple is None:
                continue
            s = 2j * np.pi * o.frequency_hz
            self.flow[part] = flow_harmonics(point.ripple, o.orders)
            self.admittance[part] = point.ripple.source_admittance(s)
            ideal = not np.any(self.admittance[part])  # a ripple given is an ideal source
            for k, polynomial, own in _changes_at(twin, o, point):
                flow, added = changes.setdefault(
                    k, (np.zeros((2, count), complex), np.zeros(count, complex))
                )
                self.flow[part] += polynomial[0]
                flow[:, part] = polynomial[1:]
                if not ideal:
                    self.admittance[part] += own[0]
                    added[part] = own[1]
        self.changes = [(k, *each) for k, each in changes.items()]
        self._changing = np.array([k for k, *_ in self.changes], int)
        self._slopes, self._curvatures = (
            np.array([flow[m] for _, flow, _ in self.changes]) for m in (0, 1)
        )
        self._admittances = np.array([own for *_, own in self.changes])

    def at(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Flow (F,), m3/s, and admittance (F,), m3/(Pa s), at `theta` (P,).

        Shaft angles are taken as 0: `turn` has them.
        """
        if not self.changes:
            return self.flow.copy(), self.admittance.copy()
        u = theta[self._changing]
        flow = self.flow + u @ self._slopes + u**2 @ self._curvatures
        return flow, self.admittance + u @ self._admittances

    def turn(self, theta: np.ndarray) -> np.ndarray:
        """Phase factor (F,) of the shaft angles in `theta` (P,) at the first samples:
        exp(j k angle) at order k."""
        turn = np.ones(len(self.flow), complex)
        for part, orders, index in zip(self._slices, self._orders, self.angles):
            if index is not None:
                turn[part] = np.exp(1j * self._parameters[index].value(theta[index]) * orders)
        return turn


def pump_changes(
    twin: Twin, speed_hz: float, load_pressure: float, ripple: FlowRipple | None = None
) -> list[tuple]:
    """(index, `RippleChange`) of each parameter of the pump, at rev/s and load pressure in Pa;
    empty where there are no such parameters, and where that pressure is unknown or not positive, as
    that of sensors which pass no static pressure.

    They are about the pump that `ripple` is simulated with, against the pressure at its outlet, in
    the frame of the data sheet's port plate. Where it is not simulated, they are about the data
    sheet's pump.
    Operating points that differ by less than OPERATING_STEP have the same changes, so that the
    halves of a recording, or a mean pressure that a fit moves, take no further simulation.
    """
    if not twin.uncertain_pump or not 0.0 < load_pressure < np.inf:
        return []
    from rippletwin.pump.ripple_sensitivity import KEYS, ripple_change
    from rippletwin.pump.simulation import PumpRipple

    speed_hz, load_pressure = (
        float(np.exp(OPERATING_STEP * np.round(np.log(x) / OPERATING_STEP)))
        for x in (speed_hz, load_pressure)
    )
    rig, changes = twin.rig, []
    uncertain = [(k, p) for k, p in enumerate(twin.parameters) if p.place == "pump"]
    values = sheet = {p.name: p.nominal for _, p in uncertain}
    pressure: float | np.ndarray = load_pressure
    if isinstance(ripple, PumpRipple):
        values = {name: getattr(ripple.geometry, KEYS[name]) for name in sheet}
        if ripple.meets_ripple:
            pressure = ripple.outlet_pressure
    pump = {**rig.pump, **{KEYS[name]: value for name, value in values.items()}}
    advance = float(np.radians(values.get("port_timing", 0.0) - sheet.get("port_timing", 0.0)))
    for k, p in uncertain:
        centre = float(p.prior.coordinate(values[p.name]))
        ends = p.value(centre + 1.0), p.value(centre - 1.0)
        change = ripple_change(
            pump, rig.fluid, 60.0 * speed_hz, pressure, p.name, ends, centre, advance
        )
        changes.append((k, change))
    return changes


def _changes_at(twin: Twin, observation, point: OperatingPoint) -> list[tuple]:
    """(index, `RippleChange.harmonics`, constant and slope (2, F) of the admittance) for each of
    the pump's parameters at an observation's frequencies.

    The twin and its copies keep them: a search makes hundreds of forward models of few recordings.
    """
    o, ripple = observation, point.ripple
    # The ripple is part of the key because of its modulation; kept, its id stays its own.
    key = o.speed_hz, point.load_pressure, np.asarray(o.orders).tobytes(), id(ripple)
    if key not in twin.kept_changes:
        mean = flow_harmonics(ripple, np.zeros(1))[0].real
        s = 2j * np.pi * o.frequency_hz
        changes = [
            (
                k,
                _modulate_change(change, ripple, o.orders, mean),
                np.outer([-change.centre, 1.0], change.source_admittance(s)),
            )
            for k, change in pump_changes(twin, o.speed_hz, point.load_pressure, ripple)
        ]
        twin.kept_changes[key] = ripple, changes
    return twin.kept_changes[key][1]


def _modulate_change(
    change, ripple: FlowRipple, orders: np.ndarray, mean_flow: float
) -> np.ndarray:
    """`RippleChange.harmonics` (3, F), phase modulated as `ripple` is."""
    if not ripple.modulation:
        return change.harmonics(orders, mean_flow)
    orders = np.asarray(orders, int)
    even = np.zeros((3, 2 * np.max(orders)), complex)
    even[:, 1:] = change.harmonics(np.arange(1, even.shape[1]), mean_flow)
    even[np.abs(even) < 1e-9 * np.max(np.abs(even))] = 0.0  # rounding
    return np.array(
        [peak_amplitudes(phase_modulate(x, ripple.modulation, 4 * len(x)))[orders] for x in even]
    )
