"""The most likely sizes of model error and source errors of `posterior`, on grids."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

MIN_MODEL_ERROR = 0.004
"""Least relative model error. However small the noise, no twin of a real line is better: the speed
wanders while harmonics are averaged, the orifice's exponent is not exactly 1/2, a mesh is finite.
"""

MODEL_ERRORS = np.geomspace(MIN_MODEL_ERROR, 1.5, 9)
SOURCE_SDS = np.array([0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0])
"""Values of sigma. The least is below what any pump model reaches: a sigma that is larger than the
truth would make the likeliest prediction too small."""
SMOOTH_SDS = np.array([0.003, 0.01, 0.03, 0.1, 0.3, 0.6])
"""Values of tau. Relief grooves and free air that a data sheet does not state halve the ripple
above 2 kHz (docs/explanation/pump.md): 0.3."""
FINER_ERRORS = 7  # values between two neighbours of a grid

Costs = Callable[[Sequence[np.ndarray]], np.ndarray]
"""Costs (T, G, D) of values (T,), (G,) and (D,) of tau, sigma and delta."""


class ErrorSizes(NamedTuple):
    """Relative standard deviations of the errors of source (tau, sigma) and model (delta)."""

    smooth: float
    source: float
    model: float


def find_most_likely_sizes(
    costs: Costs, present: ErrorSizes, any_nominal: bool, near: bool
) -> ErrorSizes:
    """The sizes of least cost.

    any_nominal   whether any source is nominal; without one tau is 0
    near          whether only values next to the `present` ones are tried: on the way of a descent
                  they move little from step to step
    """
    grids = [
        SMOOTH_SDS if any_nominal else np.zeros(1),
        SOURCE_SDS if any_nominal else SOURCE_SDS[:1],
        MODEL_ERRORS,
    ]
    if near:
        grids = [_neighbours(grid, value) for grid, value in zip(grids, present)]
    best = _least(costs, grids)
    sizes = [float(grid[k]) for grid, k in zip(grids, best)]
    for axis in (2, 1, 0):  # then each alone, between its neighbours on the grid
        finer = [np.array([value]) for value in sizes]
        finer[axis] = _between_neighbours(grids[axis], best[axis])
        sizes[axis] = float(finer[axis][_least(costs, finer)[axis]])
    return ErrorSizes(*sizes)


def _least(costs: Costs, grids: Sequence[np.ndarray]) -> tuple[int, ...]:
    """Indices of the values of least cost."""
    cost = costs(grids)
    return tuple(int(k) for k in np.unravel_index(np.argmin(cost), cost.shape))


def _neighbours(grid: np.ndarray, value: float) -> np.ndarray:
    """The values of an ascending grid next to `value`: the nearest, one below and one above."""
    distances = np.abs(np.log(np.maximum(grid, 1e-9) / max(value, 1e-9)))
    nearest = int(np.argmin(np.round(distances, 9)))  # rounding does not decide half way
    return grid[max(nearest - 1, 0) : nearest + 2]


def _between_neighbours(grid: np.ndarray, k: int) -> np.ndarray:
    """Finer values of an ascending grid between the neighbours of its entry `k`."""
    if len(grid) == 1:
        return grid
    return _finer_values(float(grid[max(k - 1, 0)]), float(grid[min(k + 1, len(grid) - 1)]))


@lru_cache(maxsize=256)
def _finer_values(low: float, high: float) -> np.ndarray:
    return np.geomspace(low, high, FINER_ERRORS)
