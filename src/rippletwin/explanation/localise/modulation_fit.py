"""Phase modulation of a pump's flow by a shaft that turns unevenly, found in the flow alone.

A shaft that leads an even rotation by Re(b exp(j t)) rad at angle t spreads the even flow Q_c at a
piston order c to the orders k about it (Jacobi and Anger), by

    F_k = sum_c Q_c (k/c) j^(k-c) J_(k-c)(c |b|) exp(j (k-c) arg b).

For a given b this is linear in the Q_c, which are free: no nominal ripple enters, nor a common
error of the line's impedance. Two sidebands for each piston order determine the one number b.
(Golub and Pereyra 1973, SIAM J. Numer. Anal. 10:413: least squares whose variables separate.)
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.special import jv

from rippletwin.explanation.localise.order_flow import OrderFlow
from rippletwin.explanation.thresholds import MIN_SHAFT_ORDER_LEVEL

CARRIER_LIMITS = (4, 12, 1000)
"""Numbers of piston orders, from the lowest, that give a first estimate of b, as a small one. High
orders have the stronger sidebands, but there a large b is not small any more."""
TYPICAL_MODULATION = 1e-3  # rad, the scale of a step


class Modulation(NamedTuple):
    """A fitted modulation.

    amplitude   b, rad
    sidebands   (F,) flow that it makes at the orders of an `OrderFlow`, m3/s; 0 at piston orders
    energy      of the flow at shaft orders, each order relative to its neighbourhood, without noise
    left        of that, what the modulation does not account for
    converged   whether the search for b ended where no step gains; one step from a given estimate
                is not meant to
    """

    amplitude: complex
    sidebands: np.ndarray
    energy: float
    left: float
    converged: bool = True

    def error_by_spread(self, pistons: int) -> float:
        """Relative standard deviation of b, in either part, by pistons of unequal angles.

        What is left is that of the patterns of deviations that no modulation makes, pistons - 3
        degrees of freedom. The pattern of the modulation has as much of it in each of its two.
        """
        left = self.left / (pistons - 3)
        return float(np.sqrt(left / max(self.energy - self.left, left, 1e-300)))


def fit_modulation(flow: OrderFlow, pistons: int, start: complex | None = None) -> Modulation:
    """Fit a modulation to the flow at all shaft orders.

    start   an estimate of b, which then takes one step; by default b is sought from several

    Each order counts relative to its neighbourhood, down to flows that the sensors hardly see.
    Orders below half the first piston order are left out: the line is not fitted there, and the
    mean flow is modulated too.
    """
    carriers = np.arange(pistons, flow.orders.max() + 1, pistons)
    half = pistons // 2
    used = (flow.orders > half) & (flow.orders <= carriers[-1] + half)
    orders = flow.orders[used]
    near = np.abs(np.subtract.outer(orders, orders)) <= half + 1
    power = near @ np.abs(flow.values[used]) ** 2 / np.sum(near, axis=1)
    pressure = np.mean(np.abs(flow.gain * flow.values)[used] ** 2)
    negligible = MIN_SHAFT_ORDER_LEVEL**2 * pressure / flow.gain[used] ** 2
    weight = 1.0 / np.sqrt(flow.variance[used] + power + negligible)
    target = weight * flow.values[used]

    def even_flow(b: complex) -> tuple[np.ndarray, np.ndarray]:
        columns = weight[:, None] * spread_by_modulation(orders, carriers, b)
        even = np.linalg.lstsq(columns, target, rcond=None)[0]
        return even, target - columns @ even

    def residual(b) -> np.ndarray:
        rest = even_flow(complex(*b))[1]
        return np.concatenate([rest.real, rest.imag])

    starts = _small_modulations(orders, target, weight, pistons) if start is None else [start]
    steps = None if start is None else 2
    solutions = [
        least_squares(residual, (b.real, b.imag), x_scale=TYPICAL_MODULATION, max_nfev=steps)
        for b in starts
    ]
    best = min(solutions, key=lambda solution: solution.cost)
    b = complex(*best.x)
    at_piston = flow.orders % pistons == 0
    spread = spread_by_modulation(flow.orders, carriers, b) @ even_flow(b)[0]
    sidebands = np.where(at_piston, 0.0, spread)
    is_shaft_order = ~at_piston[used]
    noise = float(np.sum((weight**2 * flow.variance[used])[is_shaft_order]))
    energy = float(np.sum(np.abs(target[is_shaft_order]) ** 2)) - noise
    left = 2.0 * float(best.cost) - noise
    converged = start is not None or best.status > 0
    return Modulation(b, sidebands, max(energy, 0.0), max(left, 0.0), converged)


def spread_by_modulation(orders: np.ndarray, carriers: np.ndarray, b: complex) -> np.ndarray:
    """Flow (F, C) at `orders` (F,) per unit of even flow at `carriers` (C,) by a modulation b,
    rad."""
    m = np.subtract.outer(orders, carriers)
    turned = (1j * np.exp(1j * np.angle(b))) ** m
    return jv(m, carriers * abs(b)) * turned * np.divide.outer(orders, carriers)


def _small_modulations(orders, target, weight, pistons: int) -> list[complex]:
    """Estimates of b by first order: order c +- 1 has (j/2) (c +- 1) b Q_c, of -1 with conj(b)."""
    values = target / weight
    at = {int(k): n for n, k in enumerate(orders)}
    found = []
    for limit in CARRIER_LIMITS:
        columns, sidebands = [], []
        for c in range(pistons, min(limit, len(orders)) * pistons + 1, pistons):
            for side in (-1, 1):
                if c in at and c + side in at:
                    n = at[c + side]
                    unit = 0.5j * (c + side) * values[at[c]] * weight[n]
                    columns.append((unit, 1j * side * unit))  # by Re b and by Im b
                    sidebands.append(target[n])
        real = np.array(columns).view(float).reshape(-1, 2, 2).transpose(0, 2, 1).reshape(-1, 2)
        b = np.linalg.lstsq(real, np.array(sidebands).view(float), rcond=None)[0]
        found.append(complex(*b))
    return found
