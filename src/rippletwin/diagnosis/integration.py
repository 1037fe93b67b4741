"""Integrals over leak areas of likelihoods that are sharp somewhere and flat elsewhere."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import Akima1DInterpolator
from scipy.ndimage import gaussian_filter1d

COARSE, FINE = 15, 8  # nodes over the whole prior, and about the best one in each of the steps
DENSE = 40  # points between two nodes at which the density is interpolated
PER_SD = 12.0  # grid points in a standard deviation that a density is widened by
STEPS = 3  # of refinement, each a quarter of the interval before
NEGLIGIBLE = -2.0  # log density at an end, below the greatest, from which the end does not matter


@dataclass(frozen=True)
class Density:
    """A density over the logarithm of an area in m2: nodes, ascending, and log density, (A,)."""

    nodes: np.ndarray
    log_density: np.ndarray

    @cached_property
    def _dense(self) -> tuple[np.ndarray, np.ndarray]:
        """Nodes, `DENSE` between two, and the log density there, interpolated smoothly: the density
        itself can fall by many orders of magnitude from one node to the next."""
        share = np.arange(DENSE) / DENSE
        nodes = (self.nodes[:-1, None] + np.diff(self.nodes)[:, None] * share).ravel()
        nodes = np.append(nodes, self.nodes[-1])
        smooth = Akima1DInterpolator(self.nodes, self.log_density, method="makima")
        return nodes, smooth(nodes)

    @property
    def cut_off(self) -> tuple[bool, bool]:
        """Whether the density ends at the first and at the last node where it still matters."""
        low, high = self.log_density[[0, -1]] - np.max(self.log_density)
        return bool(low > NEGLIGIBLE), bool(high > NEGLIGIBLE)

    @property
    def log_integral(self) -> float:
        """Log of the integral of the density over its nodes."""
        nodes, log_density = self._dense
        top = float(np.max(log_density))
        return top + float(np.log(np.trapezoid(np.exp(log_density - top), nodes)))

    def quantiles(self, shares) -> np.ndarray:
        """Logarithms of areas, m2, of the shape of `shares`, below which there are these shares of
        the density."""
        nodes, log_density = self._dense
        weight = np.exp(log_density - np.max(log_density))
        below = cumulative_trapezoid(weight, nodes, initial=0.0)
        return np.interp(shares, below / below[-1], nodes)

    @property
    def interval(self) -> tuple[float, float, float]:
        """Median of the area, m2, and the ends of its 95 % interval."""
        middle, low, high = map(float, np.exp(self.quantiles([0.5, 0.025, 0.975])))
        return middle, low, high

    def widen(self, sd: float) -> Density:
        """The density with an independent Gaussian error of the logarithm, of standard deviation
        `sd`, beside it."""
        step = sd / PER_SD
        grid = np.arange(self.nodes[0] - 4.0 * sd, self.nodes[-1] + 4.0 * sd, step)
        nodes, log_density = self._dense
        below = cumulative_trapezoid(np.exp(log_density - np.max(log_density)), nodes, initial=0.0)
        # shares of cells, so that a density narrower than a step is not missed
        share = np.diff(np.interp(grid, nodes, below / below[-1]))
        smooth = gaussian_filter1d(share, PER_SD, mode="constant") / step
        return Density(grid[:-1] + 0.5 * step, np.log(np.maximum(smooth, 1e-300)))


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
