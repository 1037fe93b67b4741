"""Flows that leave a line at given places whatever the pressure there.

Between them the line is as it was: with p1, q1 and p2, q2 the solutions that start at the load from
(1, 0) and (0, 1), variation of constants gives at x

    p = C1 p1 + C2 p2,    C1 = p_L - sum_{y > x} J(y) p2(y),    C2 = q_L + sum_{y > x} J(y) p1(y)

for the flows J(y) that leave at y, since p1 q2 - p2 q1 = 1 in any reciprocal line. At the pump
that makes a p_L + b q_L = c + sum_y J (a p2 - b p1).
"""

from __future__ import annotations

import numpy as np


class FundamentalSolutions:
    """Both solutions of `network` at `positions` (N,), among which flows may leave it.

    They grow as exp(gamma l), like transfer matrices: for lines that let the ripple through.
    """

    def __init__(self, network, positions: np.ndarray):
        pressure, _, entry, decay = network._sweep([(1.0, 0.0), (0.0, 1.0)], positions)
        self.pressure = pressure.swapaxes(0, 1) / decay  # (2, N, F)
        self.a, self.b = (entry[:, 1] + network.source_admittance * entry[:, 0]) / decay
        self.c = network.source_flow
        self._from_load = np.argsort(-np.asarray(positions))

    def relation(self, leaving: np.ndarray):
        """(a, b, c), each (F,), with a p + b q = c at the load, where `leaving` (N, F) leaves."""
        first, second = self.pressure
        return (
            self.a,
            self.b,
            self.c + np.sum(leaving * (self.a * second - self.b * first), axis=0),
        )

    def respond(self, load: tuple, leaving: np.ndarray):
        """Pressure (N, F) at the positions for the load's (p, q), each (F,)."""
        first, second = self.pressure
        one = load[0] - self._beyond(leaving * second)
        two = load[1] + self._beyond(leaving * first)
        return one * first + two * second

    def _beyond(self, terms):
        """Sum over the places nearer the load, the own one too: there both sums cancel."""
        total = np.empty_like(terms)
        total[self._from_load] = np.cumsum(terms[self._from_load], axis=0)
        return total
