"""The flow ripple that an unevenly turning shaft delivers.

Phase modulation moves energy from the piston orders to their sidebands. At high orders a small
modulation takes most of it, so the line must be fitted with the modulated ripple.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import j0

from rippletwin.calibration.frequency_continuation import fit_hypothesis, refine
from rippletwin.explanation.fit_starts import transfer_theta
from rippletwin.explanation.localise.shaft_orders import (
    ShaftOrders,
    analyse_shaft_orders,
    shaft_order_level,
)
from rippletwin.explanation.thresholds import MIN_SHAFT_ORDER_LEVEL
from rippletwin.spectra.frequency_selection import select_fitted_frequencies
from rippletwin.twin.effects import library
from rippletwin.twin.twin import Twin

MIN_AMPLITUDE_CHANGE = 0.01
"""Relative change of the highest order's amplitude below which a change of the modulation is
ignored: no nominal ripple is as accurate."""


def estimate_phase_modulation(rig, observations: Sequence, highest_hz: float) -> ShaftOrders | None:
    """The shaft orders by a line that is calibrated with the usual effects.

    None where their level is too low to matter. The explained line gives a better estimate.
    """
    level_and_p = None
    if "pistons" in rig.pump:
        level_and_p = shaft_order_level(observations, rig.pump["pistons"], highest_hz)
    if level_and_p is None or level_and_p[0] < MIN_SHAFT_ORDER_LEVEL:
        return None
    shaft_orders, fit = None, None
    usual = tuple(c for c in library.candidates(rig) if c[0].usual(rig, c[1]))
    for uncertain_pump, effects in ((False, ()), (True, ()), (True, usual)):
        # The pump's parameters come second: before the ripple is modulated, they would absorb what
        # the modulation takes from the piston orders.
        modulated = with_phase_modulation(observations, shaft_orders)
        data = select_fitted_frequencies(modulated, rig, highest_hz)
        base = Twin(rig, data, uncertain_pump=uncertain_pump)
        if fit is None:
            fit = fit_hypothesis(base, effects, data)
        else:
            start = transfer_theta(fit, effects, base)
            fit = refine(base, effects, data, [start], exact=False)
        shaft_orders = analyse_shaft_orders(fit.twin, observations, highest_hz)
    return shaft_orders


def modulation_differs(
    one: ShaftOrders | None, other: ShaftOrders | None, observations: Sequence
) -> bool:
    """Whether two estimates of the modulation differ enough to change the fitted ripple.

    A modulation b leaves J_0(k |b|) of a piston order k, with its phase.
    """
    first, second = _modulation_of(one), _modulation_of(other)
    return any(
        abs(np.diff([j0(np.max(o.orders) * abs(b.get(o.label, 0.0))) for b in (first, second)]))
        > MIN_AMPLITUDE_CHANGE
        for o in observations
        if o.orders is not None
    )


def with_phase_modulation(observations: Sequence, shaft_orders: ShaftOrders | None) -> list:
    """The observations with the modulation of `shaft_orders`."""
    modulation = _modulation_of(shaft_orders)
    return [
        replace(o, modulation=modulation[o.label]) if o.label in modulation else o
        for o in observations
    ]


def _modulation_of(shaft_orders: ShaftOrders | None) -> Mapping[str, complex]:
    """Modulation of each recording by its label; empty without a speed fluctuation."""
    return {} if shaft_orders is None else shaft_orders.modulation
