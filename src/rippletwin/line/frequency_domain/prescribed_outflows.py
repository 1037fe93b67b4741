"""Prescribed outflows: volume flows that leave a line at given positions, whatever the pressure.

Let (p1, q1) and (p2, q2) be the solutions of the line without outflows that start at the load from
(1, 0) and (0, 1). For outflows J(y) at positions y, variation of constants gives at x

    p = C1 p1 + C2 p2,    C1 = p_L - sum_{y > x} J(y) p2(y),    C2 = q_L + sum_{y > x} J(y) p1(y)

since p1 q2 - p2 q1 = 1 in any reciprocal line. At the pump that makes
a p_L + b q_L = c + sum_y J (a p2 - b p1).
"""

from __future__ import annotations

import numpy as np
from numba import njit


class FundamentalSolutions:
    """Both solutions of a line at `positions` (N,), where flows may leave it.

    They grow as exp(gamma l), like transfer matrices, and so are for lines that the ripple passes.
    """

    def __init__(self, network, positions: np.ndarray):
        pressure, _, entry, decay = network.sweep([(1.0, 0.0), (0.0, 1.0)], positions)
        self.first, self.second = np.ascontiguousarray(pressure.swapaxes(0, 1) / decay)  # (N, F)
        self.a, self.b = (entry[:, 1] + network.source_admittance * entry[:, 0]) / decay
        self.c = network.source_flow
        self._seen_by_load = self.a * self.second - self.b * self.first
        self._from_load = np.argsort(-np.asarray(positions))

    def load_relation(self, outflow: np.ndarray):
        """(a, b, c), each (F,), with a p + b q = c at the load under `outflow` (N, F), m3/s."""
        return self.a, self.b, self.c + _sum_products(outflow, self._seen_by_load)

    def pressure_under(self, load: tuple, outflow: np.ndarray) -> np.ndarray:
        """Pressure (N, F), Pa, at the positions, for (p, q) at the load, each (F,), Pa and m3/s."""
        return _add_from_load(self._from_load, self.first, self.second, outflow, *load)


@njit(cache=True, error_model="numpy")
def _sum_products(one, other):
    """Sums (F,) of the products of two arrays (N, F)."""
    total = np.zeros(one.shape[1], np.complex128)
    for n in range(len(one)):
        for f in range(len(total)):
            total[f] += one[n, f] * other[n, f]
    return total


@njit(cache=True, error_model="numpy")
def _add_from_load(order, first, second, outflow, p, q):
    """Pressure (N, F) at positions from the load on, in `order` (N,). An outflow's own term cancels
    between the two constants."""
    pressure = np.empty_like(first)
    one, two = p.copy(), q.copy()
    for n in order:
        for f in range(len(one)):
            pressure[n, f] = one[f] * first[n, f] + two[f] * second[n, f]
            one[f] -= outflow[n, f] * second[n, f]
            two[f] += outflow[n, f] * first[n, f]
    return pressure
