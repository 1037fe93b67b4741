"""Order analysis: ripple at shaft orders that are no multiples of the number of pistons.

Equal pistons on an evenly turning shaft have none, so these orders are not fitted with the line.
The accepted twin tells which flow at the pump they need, and whether one flow accounts for every
sensor. A shaft that turns unevenly modulates the phase of the flow, which makes sidebands of the
piston orders (Randall 2011, Vibration-based Condition Monitoring, sec. 3.3). What modulation does
not account for is a spread between the pistons.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.special import chdtrc

from rippletwin.explanation.thresholds import (
    MIN_COHERENT_SHARE,
    MIN_SHAFT_ORDER_LEVEL,
    MODULATION_SHARE,
    SHAFT_ORDER_SIGNIFICANCE,
)
from rippletwin.harmonics import peak_amplitudes, phase_modulate
from rippletwin.spectra.frequency_selection import select_below
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.twin import Twin

LINE_MODEL_ERROR = 0.02
"""Relative error of the twin at shaft orders, per sensor and order. It is larger than at the piston
orders: there the load is fitted with all products of harmonics, here it is linear."""
PISTON_ORDER_LIMITS = (4, 12, 1000)
"""Piston orders up to which a modulation is first estimated as a small one."""


@dataclass(frozen=True)
class ShaftOrders:
    """Ripple at shaft orders that are no multiples of the number of pistons.

    level       its norm over that of the whole ripple, both at the sensors
    p_value     of noise alone
    coherence   share of its energy that one flow at the pump accounts for
    name        "speed_fluctuation", "piston_spread" or None
    value       amplitude of the modulation in rad, or rms spread of the flow over the mean flow
    interval    95 % interval of `value`; None where it is not known
    modulation  complex amplitude b of each recording by its label: the shaft leads an even rotation
                by Re(b exp(j t)) rad at angle t
    """

    level: float
    p_value: float
    coherence: float
    name: str | None
    value: float
    modulation: Mapping[str, complex] = field(default_factory=dict)
    interval: tuple[float, float] | None = None


def shaft_order_level(
    observations: Sequence, pistons: int, highest_hz: float
) -> tuple[float, float] | None:
    """`level` and `p_value` of `ShaftOrders`; None where no observation has such orders."""
    recordings = with_shaft_orders(observations, pistons, highest_hz)
    if not recordings:
        return None
    signal = energy = chi_squared = 0.0
    degrees_of_freedom = 0
    for o, is_shaft_order in recordings:
        power = np.abs(o.values[:, is_shaft_order]) ** 2
        variance = o.variance[:, is_shaft_order]
        energy += np.sum(np.abs(o.values) ** 2)
        signal += max(np.sum(power) - np.sum(variance), 0.0)
        chi_squared += 2 * np.sum(power / variance)
        degrees_of_freedom += 2 * power.size
    return float(np.sqrt(signal / energy)), float(chdtrc(degrees_of_freedom, chi_squared))


def analyse_shaft_orders(
    twin: Twin,
    observations: Sequence,
    highest_hz: float,
    modulation_share: float = MODULATION_SHARE,
) -> ShaftOrders | None:
    """Analyse the shaft orders of periodic observations; None where there are none.

    They are named a speed fluctuation if phase modulation accounts for `modulation_share` of their
    energy.
    """
    pistons = twin.rig.pump.get("pistons")
    level_and_p = shaft_order_level(observations, pistons, highest_hz) if pistons else None
    if level_and_p is None:
        return None
    level, p_value = level_and_p
    energy = incoherent = pump_energy = unmodulated = 0.0
    modulation, spreads = {}, []
    for o, is_shaft_order in with_shaft_orders(observations, pistons, highest_hz):
        forward = ForwardModel(twin, [o])
        (response,) = forward.unit_response(twin.theta)
        flow = estimate_flow(o.values, response, variance_about_twin(o))
        residual = o.values - response * flow
        energy += np.sum(np.abs(o.values[:, is_shaft_order]) ** 2)
        incoherent += np.sum(np.abs(residual[:, is_shaft_order]) ** 2)
        even = even_spectrum(forward, twin.theta, flow, is_shaft_order)
        fitted = fit_modulation(even, o.orders, is_shaft_order, flow, response, pistons)
        modulation[o.label] = fitted.modulation
        unmodulated += fitted.energy_left
        pump_energy += fitted.energy
        spreads.append(relative_spread(o.orders, flow, pistons, even[0].real))
    coherence = 1.0 - float(incoherent / max(energy, 1e-300))
    name, value = None, 0.0
    if (
        level > MIN_SHAFT_ORDER_LEVEL
        and p_value < SHAFT_ORDER_SIGNIFICANCE
        and coherence > MIN_COHERENT_SHARE
    ):
        is_modulation = unmodulated < (1.0 - modulation_share) * pump_energy
        name = "speed_fluctuation" if is_modulation else "piston_spread"
        value = float(np.mean(np.abs(list(modulation.values())) if is_modulation else spreads))
    return ShaftOrders(level, p_value, coherence, name, value, modulation)


def estimate_flow(values: np.ndarray, response: np.ndarray, variance: np.ndarray) -> np.ndarray:
    """Least-squares flow (F,) at the pump from readings, responses and variances (S, F)."""
    weight = 1.0 / variance
    square = np.sum(weight * np.abs(response) ** 2, axis=0)
    return np.sum(weight * np.conj(response) * values, axis=0) / square


def even_spectrum(
    forward: ForwardModel, theta: np.ndarray, flow: np.ndarray, is_shaft_order: np.ndarray
) -> np.ndarray:
    """Spectrum (K,) of the pump's flow on an evenly turning shaft, from order 0, the mean.

    `forward` has one recording. At the piston orders the spectrum is that of the nominal ripple at
    `theta`, or the estimated `flow` (F,) if there is none.
    """
    (o,) = forward.observations
    orders, point = np.asarray(o.orders, int), forward.twin.operating_point(o)
    even = np.zeros(orders.max() + 1, complex)
    at_pistons = flow if point.ripple is None else forward.source.at(theta)[0]
    even[orders[~is_shaft_order]] = at_pistons[~is_shaft_order]
    even[0] = point.mean_flow
    return even


def relative_spread(orders, flow: np.ndarray, pistons: int, mean_flow: float) -> float:
    """Rms of the flow (F,) below the first piston order over the mean flow."""
    below = np.asarray(orders, int) < pistons
    return float(np.sqrt(0.5 * np.sum(np.abs(flow[below]) ** 2)) / mean_flow)


class Modulation(NamedTuple):
    """A fitted modulation (rad), and the pressure energy at shaft orders with it removed and
    altogether."""

    modulation: complex
    energy_left: float
    energy: float


def fit_modulation(
    even: np.ndarray,
    orders: np.ndarray,
    is_shaft_order: np.ndarray,
    flow: np.ndarray,
    response: np.ndarray,
    pistons: int,
    start: complex | None = None,
) -> Modulation:
    """Fit the modulation b to the flow at shaft orders.

    even (K,)          spectrum of the flow on an even shaft
    orders, flow (F,)  at all orders, with response (S, F) of the sensors to a unit flow
    start              an estimate of b, which then takes one step; by default b is sought from
                       several linear estimates

    The piston orders only determine the size of the whole ripple: the impedance of the line may be
    wrong by some per cent, and b would be wrong by as much. The objective has several minima in b.
    Low orders alone give linear estimates from which a descent finds the right one.
    """
    orders = np.asarray(orders, int)
    root = np.sqrt(np.sum(np.abs(response) ** 2, axis=0))
    target = root * flow

    def residual(b):
        modulated = peak_amplitudes(phase_modulate(even, complex(*b), 4 * len(even)))
        modelled = root * modulated[orders]
        at_pistons = modelled[~is_shaft_order]
        size = np.vdot(at_pistons, target[~is_shaft_order]).real
        size /= np.vdot(at_pistons, at_pistons).real
        rest = target[is_shaft_order] - size * modelled[is_shaft_order]
        return np.concatenate([rest.real, rest.imag])

    if start is None:
        unmodulated, step = residual((0, 0)), 1e-6
        slopes = [(residual(d) - unmodulated) / step for d in ((step, 0), (0, step))]
        slope, starts = np.stack(slopes, axis=1), []
        for limit in PISTON_ORDER_LIMITS:
            low = np.tile(orders[is_shaft_order] < limit * pistons, 2)
            starts.append(np.linalg.lstsq(-slope[low], unmodulated[low], rcond=None)[0])
        solutions = [least_squares(residual, b, x_scale=1e-3) for b in starts]
    else:
        one_step = least_squares(residual, (start.real, start.imag), x_scale=1e-3, max_nfev=2)
        solutions = [one_step]
    best = min(solutions, key=lambda solution: solution.cost)
    energy = float(np.sum(np.abs(target[is_shaft_order]) ** 2))
    return Modulation(complex(*best.x), 2.0 * float(best.cost), energy)


def with_shaft_orders(observations: Sequence, pistons: int, highest_hz: float) -> list[tuple]:
    """(observation, mask (F,) of orders that are no multiple of `pistons`) where there are any."""
    selected = [select_below(o, highest_hz) for o in observations if o.orders is not None]
    pairs = [(o, np.asarray(o.orders) % pistons != 0) for o in selected]
    return [(o, is_shaft_order) for o, is_shaft_order in pairs if np.any(is_shaft_order)]


def variance_about_twin(o) -> np.ndarray:
    """Variance (S, F) of an observation about the twin: noise and LINE_MODEL_ERROR."""
    return o.variance + LINE_MODEL_ERROR**2 * np.mean(np.abs(o.values) ** 2, axis=0)
