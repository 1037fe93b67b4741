"""Lines at shaft orders that equal pistons at even speed do not make.

The nominal pump has none, so they are no matter of fitting the line: the line as it was explained
tells what flow at the pump they come from, and whether one flow accounts for every sensor. A shaft
that turns unevenly makes sidebands of the piston orders; what is left is spread of the pistons.
What the sidebands have, the piston orders lack: at high orders a small swing takes most of them,
and the line must be fitted with the ripple that such a shaft delivers.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import least_squares
from scipy.special import chdtrc

from rippletwin.case.model import FlowRipple
from rippletwin.harmonics import flow_harmonics, peak_amplitudes, phase_modulate
from rippletwin.spectra.frequency_selection import select_below
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.twin import Twin

LINE_MODEL_ERROR = (
    0.02  # of the lines, where no orifice couples them: the line's own error and more
)
MIN_RELATIVE_LEVEL = 0.01  # of the ripple: below it the lines are no effect worth a name
LEVEL_SIGNIFICANCE = 1e-6
MODULATION_SHARE = 0.9  # of the lines' energy that modulation must explain to be the name
ROUGH_MODULATION_SHARE = 0.7  # the same by a line that is only calibrated: it may be off by as much
MIN_PHASE_CHANGE = 0.02  # rad at the highest order: below it a swing told anew changes nothing
LOW_PISTON_ORDERS = (
    4,
    12,
    1000,
)  # piston orders up to which modulation is first sought as a small one


@dataclass(frozen=True)
class ShaftOrders:
    """Lines at other orders than the pistons'.

    relative    their norm over the ripple's, both at the sensors
    p_value     of noise alone making them
    coherent    share of their energy that one flow at the pump accounts for
    name        "speed_fluctuation", "piston_spread" or None
    value       modulation of the shaft angle in rad, or spread over the mean flow, rms
    modulation  b of each recording by its label: the shaft is ahead by Re(b exp(j t)), rad
    """

    relative: float
    p_value: float
    coherent: float
    name: str | None
    value: float
    modulation: Mapping[str, complex] = field(default_factory=dict)


def shaft_order_level(
    observations: Sequence, pistons: int, highest_hz: float
) -> tuple[float, float] | None:
    """Norm of the lines at other orders over the ripple's, and the probability that noise alone
    makes them; None where no observation has such orders."""
    data = _with_shaft_orders(observations, pistons, highest_hz)
    if not data:
        return None
    lines = energy = chi = 0.0
    count = 0
    for o, off in data:
        power = np.abs(o.values[:, off]) ** 2
        variance = _variance(o)[:, off]
        energy += np.sum(np.abs(o.values) ** 2)
        lines += max(np.sum(power) - np.sum(variance), 0.0)
        chi += 2 * np.sum(power / variance)
        count += 2 * power.size
    return float(np.sqrt(lines / energy)), float(chdtrc(count, chi))


def analyse_shaft_orders(
    twin: Twin, observations: Sequence, highest_hz: float, share: float = MODULATION_SHARE
) -> ShaftOrders | None:
    """Judge the periodic observations with all their orders; None where there are none. Modulation
    that accounts for `share` of the lines' energy is the name."""
    pistons = twin.rig.pump.get("pistons")
    found = shaft_order_level(observations, pistons, highest_hz) if pistons else None
    if found is None:
        return None
    relative, p = found
    explained = lines = modulated = flows = 0.0
    modulation, spread = {}, []
    for o, off in _with_shaft_orders(observations, pistons, highest_hz):
        orders = np.asarray(o.orders, int)
        unit = _response(twin, o)
        power = np.mean(np.abs(o.values) ** 2, axis=0)
        weight = 1.0 / (_variance(o) + (LINE_MODEL_ERROR**2 * power)[None])
        flow = np.sum(weight * np.conj(unit) * o.values, 0) / np.sum(weight * np.abs(unit) ** 2, 0)
        left = o.values - unit * flow
        lines += np.sum(np.abs(o.values[:, off]) ** 2)
        explained += np.sum(np.abs(left[:, off]) ** 2)
        point = twin.operating_point(o)
        even = np.zeros(orders.max() + 1, complex)
        at = orders[~off]
        even[at] = flow[~off]
        if point.ripple is not None:
            even[at] = ForwardModel(twin, [o]).source.at(twin.theta)[0][~off]
        even[0] = point.mean_flow
        b, rest, whole = _fit_modulation(even, orders, off, flow, unit, pistons)
        modulation[o.label] = b
        modulated += rest
        flows += whole
        spread.append(
            float(np.sqrt(0.5 * np.sum(np.abs(flow[orders < pistons]) ** 2)) / point.mean_flow)
        )
    coherent = 1.0 - float(explained / max(lines, 1e-300))
    name, value = None, 0.0
    if relative > MIN_RELATIVE_LEVEL and p < LEVEL_SIGNIFICANCE and coherent > 0.5:
        by_speed = modulated < (1.0 - share) * flows
        name = "speed_fluctuation" if by_speed else "piston_spread"
        value = float(np.mean(np.abs(list(modulation.values())) if by_speed else spread))
    return ShaftOrders(relative, p, coherent, name, value, modulation)


def modulation_differs(
    one: ShaftOrders | None, other: ShaftOrders | None, observations: Sequence
) -> bool:
    """Whether a shaft turns so differently by two judgements that the ripple tells."""
    one, other = _modulation_of(one), _modulation_of(other)
    top = {o.label: np.max(o.orders) for o in observations if o.orders is not None}
    return any(
        top.get(label, 0.0) * abs(one.get(label, 0.0) - other.get(label, 0.0)) > MIN_PHASE_CHANGE
        for label in {*one, *other}
    )


def with_phase_modulation(observations: Sequence, shaft: ShaftOrders | None) -> list:
    """The observations with the ripple that a shaft delivers which turns as `shaft` says."""
    swing = _modulation_of(shaft)
    return [
        o
        if o.flow_ripple is None or o.label not in swing
        else replace(o, flow_ripple=modulate_ripple(o.flow_ripple, swing[o.label]))
        for o in observations
    ]


def _modulation_of(shaft: ShaftOrders | None) -> Mapping[str, complex]:
    """Modulation of the recordings of a shaft that swings; empty of one that does not."""
    return shaft.modulation if shaft is not None and shaft.name == "speed_fluctuation" else {}


def modulate_ripple(ripple: FlowRipple, modulation: complex) -> FlowRipple:
    """The flow ripple of a shaft that is ahead of even turning by Re(b exp(j t)) rad at angle t."""
    count = max(len(ripple.flow) // 2, 8)
    spectrum = flow_harmonics(ripple, np.arange(count))
    flow = phase_modulate(spectrum, modulation, 4 * count)
    angle = 360.0 * np.arange(len(flow)) / len(flow)
    return replace(ripple, angle_deg=angle, flow=flow, swing=modulation)


def _with_shaft_orders(observations: Sequence, pistons: int, highest_hz: float) -> list[tuple]:
    """(observation, which of its orders are no multiple of `pistons`) where there are any."""
    data = [select_below(o, highest_hz) for o in observations if o.orders is not None]
    data = [(o, np.asarray(o.orders) % pistons != 0) for o in data]
    return [(o, off) for o, off in data if np.any(off)]


def _variance(o) -> np.ndarray:
    return np.einsum("fss->sf", o.covariance).real


def _response(twin: Twin, observation) -> np.ndarray:
    """Readings (S, F) for unit flow at every order, load and line linear."""
    return ForwardModel(twin, [observation]).unit_response(twin.theta)[0]


def _fit_modulation(even, orders, off, flow, unit, pistons):
    """Best modulation b, and the pressure energy at other orders with and without it taken off.

    even (K,) is the flow's spectrum at even speed from order 0; orders, flow (F,) and unit (S, F)
    are what there is, at piston orders too where not `off` (F,). Those tell only how large the
    whole ripple is: the impedance that the line was given may be some per cent wrong, and b would
    be as much. Far from its value b has other minima, so that it is first sought where it is small:
    at low orders.
    """
    root = np.sqrt(np.sum(np.abs(unit) ** 2, axis=0))
    target = root * flow

    def left(b):
        swing = root * peak_amplitudes(phase_modulate(even, complex(*b), 4 * len(even)))[orders]
        pumped = swing[~off]
        size = np.vdot(pumped, target[~off]).real / np.vdot(pumped, pumped).real
        rest = target[off] - size * swing[off]
        return np.concatenate([rest.real, rest.imag])

    none, step, found = left((0, 0)), 1e-6, []
    slope = np.stack([(left(d) - none) / step for d in ((step, 0), (0, step))], axis=1)
    for most in LOW_PISTON_ORDERS:
        low = np.tile(orders[off] < most * pistons, 2)
        start = np.linalg.lstsq(-slope[low], none[low], rcond=None)[0]
        found.append(least_squares(left, start, x_scale=1e-3))
    best = min(found, key=lambda f: f.cost)
    return complex(*best.x), 2.0 * float(best.cost), float(np.sum(np.abs(target[off]) ** 2))
