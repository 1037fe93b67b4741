"""Prescribed outflows: volume flows that leave a line at given positions, whatever the pressure.

Let (p1, q1) and (p2, q2) be the solutions of the line without outflows that start at the load from
(1, 0) and (0, 1). For outflows J(y) at positions y, variation of constants gives at x

    p = C1 p1 + C2 p2,    C1 = p_L - sum_{y > x} J(y) p2(y),    C2 = q_L + sum_{y > x} J(y) p1(y)

since p1 q2 - p2 q1 = 1 in any reciprocal line. At the pump that makes
a p_L + b q_L = c + sum_y J (a p2 - b p1).
"""

from __future__ import annotations

import numpy as np


class FundamentalSolutions:
    """Both solutions of a line at `positions` (N,), where flows may leave it.

    They grow as exp(gamma l), like transfer matrices, and so are for lines that the ripple passes.
    """

    def __init__(self, network, positions: np.ndarray):
        pressure, _, entry, decay = network.sweep([(1.0, 0.0), (0.0, 1.0)], positions)
        self.pressure = pressure.swapaxes(0, 1) / decay  # (2, N, F)
        self.a, self.b = (entry[:, 1] + network.source_admittance * entry[:, 0]) / decay
        self.c = network.source_flow
        self._from_load = np.argsort(-np.asarray(positions))

    def load_relation(self, outflow: np.ndarray):
        """(a, b, c), each (F,), with a p + b q = c at the load under `outflow` (N, F), m3/s."""
        first, second = self.pressure
        return (
            self.a,
            self.b,
            self.c + np.sum(outflow * (self.a * second - self.b * first), axis=0),
        )

    def pressure_under(self, load: tuple, outflow: np.ndarray) -> np.ndarray:
        """Pressure (N, F), Pa, at the positions, for (p, q) at the load, each (F,), Pa and m3/s."""
        first, second = self.pressure
        one = load[0] - self._sum_to_load(outflow * second)
        two = load[1] + self._sum_to_load(outflow * first)
        return one * first + two * second

    def _sum_to_load(self, terms):
        """Sums (N, F) over the positions nearer the load. Each includes its own position's term,
        which cancels between the two constants."""
        total = np.empty_like(terms)
        total[self._from_load] = np.cumsum(terms[self._from_load], axis=0)
        return total
