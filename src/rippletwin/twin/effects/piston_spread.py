"""Unequal pistons: lines at every shaft order, the lowest strongest.

They look like a fault of a single piston, so that a twin must not absorb them silently.
"""

from __future__ import annotations

import numpy as np

from rippletwin.harmonics import one_period
from rippletwin.twin.effects.base import Effect, source_place
from rippletwin.twin.parameters import Parameter
from rippletwin.twin.priors import normal


def half_sine(orders: np.ndarray) -> np.ndarray:
    """Harmonics (F,) of one piston's delivery, a half sine of unit mean, at shaft `orders` >= 1."""
    n = np.asarray(orders, dtype=float)
    even = np.where(n % 2 == 0, -2.0 / np.where(n == 1, np.inf, n**2 - 1.0), 0.0)
    return np.where(n == 1, -0.5j * np.pi, even)


def _places(rig):
    # Of an even number the harmonic of half that order is real: `spread` has odd numbers alone.
    return source_place(rig) if rig.pump.get("pistons", 9) % 2 else ()


def spread(orders: np.ndarray, values) -> np.ndarray:
    """Harmonics (F,) that unequal pistons, an odd number of them, add per unit of mean flow, at
    shaft `orders` >= 1; shaft angles count from the recording's first sample."""
    count = 2 * len([name for name in values if name.startswith("cosine")]) + 1
    turn = np.asarray(orders, int) % count
    amplitude = np.zeros(len(turn), complex)
    for m in range(1, count // 2 + 1):
        a = complex(values[f"cosine_{m}"], values[f"sine_{m}"])
        amplitude = (
            amplitude + np.where(turn == m, a, 0.0) + np.where(turn == count - m, np.conj(a), 0.0)
        )
    return np.where(turn == 0, 0.0, half_sine(orders) * amplitude)


def _apply(network, state, values, place):
    network.source_flow = network.source_flow + state.mean_flow * spread(state.orders, values)


def _parameters(rig, place):
    pairs = rig.pump.get("pistons", 9) // 2
    return tuple(
        Parameter(f"{part}_{m}", "1", normal(0.0, 5e-3))
        for m in range(1, pairs + 1)
        for part in ("cosine", "sine")
    )


def _apply_in_time(line, state, values, place):
    count = len(line.flow)
    orders = np.arange(1, count // 2 + 1)
    added = state.mean_flow * spread(orders, values)
    line.flow = line.flow + one_period(added, count, orders)


EFFECT = Effect(
    name="piston_spread",
    element="source",
    medium="any",
    equation="Q_n += Q_0 h_n A_(n mod z), A_m = (1/z) sum_p a_p exp(-2 pi j p m/z) = cosine_m + "
    "j sine_m: piston p delivers 1 + a_p times the mean, h_n the harmonics of a half sine; odd z",
    source="Ivantysyn & Ivantysynova 2001, Hydrostatic Pumps and Motors, sec. 3.2 (kinematic flow)",
    parameters=_parameters,
    places=_places,
    apply=_apply,
    apply_in_time=_apply_in_time,
)
