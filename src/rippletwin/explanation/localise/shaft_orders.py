"""Order analysis: ripple at shaft orders that are no multiples of the number of pistons.

Equal pistons on an evenly turning shaft have none, so these orders are not fitted with the line.
The accepted twin tells which flow at the pump they need, and whether one flow accounts for every
sensor. They have two causes. A shaft that turns unevenly modulates the phase of the flow, which
makes sidebands of the piston orders (Randall 2011, Vibration-based Condition Monitoring, sec. 3.3).
Pistons that differ make lines at all shaft orders; an order k is one of z - 1 patterns, k mod z, of
deviations around the z pistons.

Deviations that are independent from piston to piston have all patterns alike. Modulation has those
next to the piston orders, k mod z = 1 and z - 1, alone. It is the cause if so much of the energy
follows it that a share as large has a small probability with independent deviations: the pattern
has two of z - 1 degrees of freedom, so its share has a beta distribution.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import chdtrc

from rippletwin.explanation.localise.modulation_fit import Modulation, fit_modulation
from rippletwin.explanation.localise.order_flow import (
    OrderFlow,
    estimate_order_flow,
    with_shaft_orders,
)
from rippletwin.explanation.thresholds import (
    MIN_COHERENT_SHARE,
    MIN_SHAFT_ORDER_LEVEL,
    MODULATION_SIGNIFICANCE,
    SHAFT_ORDER_SIGNIFICANCE,
)
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.twin import Twin


@dataclass(frozen=True)
class ShaftEffect:
    """What makes lines at shaft orders.

    name      "speed_fluctuation" or "piston_spread"
    value     amplitude of the modulation in rad, or rms spread of the flow over the mean flow; None
              where the mean flow, or the flow at all orders below the number of pistons, is unknown
    interval  95 % interval of `value`; None where it is not known
    """

    name: str
    value: float | None
    interval: tuple[float, float] | None = None


@dataclass(frozen=True)
class ShaftOrders:
    """Ripple at shaft orders that are no multiples of the number of pistons.

    level       its norm over that of the whole ripple, both at the sensors
    p_value     of noise alone
    coherence   share of its energy that one flow at the pump accounts for
    effects     what makes it, the stronger first; empty where that is not known
    modulation  complex amplitude b of each recording by its label, where a speed fluctuation is
                among the effects: the shaft leads an even rotation by Re(b exp(j t)) rad at angle t
    converged   whether the fits of the modulation did
    """

    level: float
    p_value: float
    coherence: float
    effects: tuple[ShaftEffect, ...] = ()
    modulation: Mapping[str, complex] = field(default_factory=dict)
    converged: bool = True

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects."""
        return tuple(effect.name for effect in self.effects)


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
    twin: Twin, observations: Sequence, highest_hz: float
) -> ShaftOrders | None:
    """Analyse the shaft orders of periodic observations; None where there are none."""
    pistons = twin.rig.pump.get("pistons")
    level_and_p = shaft_order_level(observations, pistons, highest_hz) if pistons else None
    if level_and_p is None:
        return None
    level, p_value = level_and_p
    energy = incoherent = 0.0
    flows = {}
    for o, is_shaft_order in with_shaft_orders(observations, pistons, highest_hz):
        flow = flows[o.label] = estimate_order_flow(ForwardModel(twin, [o]), twin.theta)
        energy += np.sum(np.abs(o.values[:, is_shaft_order]) ** 2)
        incoherent += np.sum(np.abs(flow.unmatched[:, is_shaft_order]) ** 2)
    coherence = 1.0 - float(incoherent / max(energy, 1e-300))
    found = ShaftOrders(level, p_value, coherence)
    if (
        level <= MIN_SHAFT_ORDER_LEVEL
        or p_value >= SHAFT_ORDER_SIGNIFICANCE
        or coherence <= MIN_COHERENT_SHARE
    ):
        return found
    modulations = {label: fit_modulation(flow, pistons) for label, flow in flows.items()}
    converged = all(m.converged for m in modulations.values())
    effects = _name_effects(list(flows.values()), list(modulations.values()), pistons)
    if "speed_fluctuation" not in [effect.name for effect in effects]:
        modulations = {}
    amplitudes = {label: m.amplitude for label, m in modulations.items()}
    return ShaftOrders(level, p_value, coherence, effects, amplitudes, converged)


def _name_effects(
    flows: Sequence[OrderFlow], modulations: Sequence[Modulation], pistons: int
) -> tuple[ShaftEffect, ...]:
    """The effects that make the flow at shaft orders, the stronger first."""
    energy = sum(m.energy for m in modulations)
    share = 1.0 - sum(m.left for m in modulations) / max(energy, 1e-300)
    whole = _power(flows, [flow.values for flow in flows])
    modulated = _power(flows, [m.sidebands for m in modulations])
    if (
        probability_of_share(share, pistons) >= MODULATION_SIGNIFICANCE
        or modulated <= MIN_SHAFT_ORDER_LEVEL**2 * whole
    ):
        return (_effect("piston_spread", flows, [None] * len(flows), pistons),)
    rests = [
        np.where(_apart(flow.orders, pistons), flow.values - m.sidebands, 0.0)
        for flow, m in zip(flows, modulations)
    ]
    spread = _power(flows, rests) / _share_apart(pistons)
    fluctuation = _effect("speed_fluctuation", flows, modulations, pistons)
    if spread <= MIN_SHAFT_ORDER_LEVEL**2 * whole:
        return (fluctuation,)
    beside = _effect("piston_spread", flows, modulations, pistons)
    return (fluctuation, beside) if modulated >= spread else (beside, fluctuation)


def _power(flows: Sequence[OrderFlow], amplitudes: Sequence[np.ndarray]) -> float:
    """Square sum of the pressures that `amplitudes` (F,) of the flow make in all recordings."""
    return sum(float(np.sum(np.abs(f.gain * a) ** 2)) for f, a in zip(flows, amplitudes))


def _effect(
    name: str, flows: Sequence[OrderFlow], modulations: Sequence[Modulation | None], pistons: int
) -> ShaftEffect:
    """An effect with its mean amplitude in all recordings."""
    values = [amplitude_of(name, f, m, pistons) for f, m in zip(flows, modulations)]
    known = [value for value in values if np.isfinite(value)]
    return ShaftEffect(name, float(np.mean(known)) if known else None)


def probability_of_share(share: float, pistons: int) -> float:
    """Probability of at least this share of the energy in one pattern of two degrees of freedom,
    if the deviations of the pistons are independent."""
    return float(np.clip(1.0 - share, 0.0, 1.0) ** (0.5 * (pistons - 3)))


def amplitude_of(name: str, flow: OrderFlow, modulation: Modulation | None, pistons: int) -> float:
    """`value` of an effect in one recording, NaN where it is not known; `modulation` is None where
    there is none."""
    if name == "speed_fluctuation":
        assert modulation is not None
        return abs(modulation.amplitude)
    below, spread = flow.orders < pistons, flow.values
    if modulation is not None:
        below = below & _apart(flow.orders, pistons)
        spread = flow.values - modulation.sidebands
    if not np.any(below):
        return np.nan
    # Of independent deviations each of these orders has the same share of the energy.
    seen = np.count_nonzero(below) / (pistons - 1)
    return _rms(spread[below]) / np.sqrt(seen) / flow.mean_flow


def _apart(orders: np.ndarray, pistons: int) -> np.ndarray:
    """Mask (F,) of shaft orders that are not next to a piston order, where modulation is."""
    turn = orders % pistons
    return (turn > 1) & (turn < pistons - 1)


def _share_apart(pistons: int) -> float:
    """Share of the patterns of deviations that are not next to a piston order."""
    return (pistons - 3) / (pistons - 1)


def _rms(amplitudes: np.ndarray) -> float:
    """Rms of a wave with peak `amplitudes` (F,)."""
    return float(np.sqrt(0.5 * np.sum(np.abs(amplitudes) ** 2)))
