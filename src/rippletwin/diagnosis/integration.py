"""Integrals over leak areas of likelihoods that are sharp somewhere and flat elsewhere."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

COARSE, FINE = 13, 8  # nodes over the whole prior, and about the best one in each of the steps
STEPS = 3  # of refinement, each a quarter of the interval before


@dataclass(frozen=True)
class Density:
    """A density over the logarithm of an area: nodes (A,), ascending, and log density (A,)."""

    nodes: np.ndarray
    log_density: np.ndarray

    @property
    def log_integral(self) -> float:
        """Of the density over its nodes, by trapezoids."""
        top = float(np.max(self.log_density))
        return top + float(np.log(np.trapezoid(np.exp(self.log_density - top), self.nodes)))

    def quantiles(self, shares) -> np.ndarray:
        """Nodes, interpolated, below which there are these shares of the density."""
        weight = np.exp(self.log_density - np.max(self.log_density))
        steps = 0.5 * (weight[1:] + weight[:-1]) * np.diff(self.nodes)
        below = np.concatenate([[0.0], np.cumsum(steps)])
        return np.interp(shares, below / below[-1], self.nodes)


def explore(log_density: Callable[[float], float], low: float, high: float) -> Density:
    """`log_density` between `low` and `high`: at even nodes, and ever more closely about the best.

    Where it falls off between two nodes by more than a narrow mode can be missed by, the best node
    is beside the mode, because the flanks of the mode reach further than the nodes are apart.
    """
    known = {x: log_density(x) for x in np.linspace(low, high, COARSE)}
    for _ in range(STEPS):
        nodes = np.array(sorted(known))
        best = int(np.argmax([known[x] for x in nodes]))
        left, right = nodes[max(best - 1, 0)], nodes[min(best + 1, len(nodes) - 1)]
        for x in np.linspace(left, right, FINE + 2)[1:-1]:
            if x not in known:
                known[x] = log_density(x)
    nodes = np.array(sorted(known))
    return Density(nodes, np.array([known[x] for x in nodes]))
