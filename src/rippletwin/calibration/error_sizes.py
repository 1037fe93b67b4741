"""The most likely sizes of model error and source errors of `posterior`.

They change continuously with the residual. Sizes from a grid would jump between two of its values,
and a descent that estimates them after each of its steps would then not converge.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

MIN_MODEL_ERROR = 0.001
"""Least relative model error. Below it are errors of the twin's own numerics: a nonlinear load is
solved, and derivatives are taken, to no more."""

MODEL_ERRORS = np.geomspace(MIN_MODEL_ERROR, 1.5, 11)
SOURCE_SDS = np.array([0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0])
"""Values of sigma. The least is below what any pump model reaches: a sigma that is larger than the
truth would make the likeliest prediction too small."""
SMOOTH_SDS = np.array([0.003, 0.01, 0.03, 0.1, 0.3, 0.6])
"""Values of tau. Relief grooves and free air that a data sheet does not state halve the ripple
above 2 kHz (docs/explanation/pump.md): 0.3."""
REACH, VALUES_ALONG = 3.0, 7
"""Factor to either side of a size within which it is sought, and values that are tried there."""
SHARES_ALONG = np.linspace(0.0, 1.0, VALUES_ALONG)
CLOSE_RATIOS = 1.1 ** np.arange(-1.0, 2.0)  # three more values about the least

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
    near          whether they are sought about the `present` ones: on the way of a descent they
                  move little from step to step
    """
    grids = [
        SMOOTH_SDS if any_nominal else np.zeros(1),
        SOURCE_SDS if any_nominal else SOURCE_SDS[:1],
        MODEL_ERRORS,
    ]
    if near:
        sizes = [float(min(max(x, grid[0]), grid[-1])) for grid, x in zip(grids, present)]
    else:
        cost = costs(grids)
        best = np.unravel_index(np.argmin(cost), cost.shape)
        sizes = [float(grid[k]) for grid, k in zip(grids, best)]
    for axis in (2, 1, 0):
        if len(grids[axis]) > 1:
            sizes[axis] = _least_along(costs, sizes, axis, grids[axis][0], grids[axis][-1])
    return ErrorSizes(*sizes)


def _least_along(costs: Costs, sizes: Sequence[float], axis: int, low: float, high: float) -> float:
    """The value of least cost of one of `sizes`, the others as they are, between its bounds."""

    def vertex(values: np.ndarray) -> float:
        along = [np.array([value]) for value in sizes]
        along[axis] = values
        return _vertex(values.tolist(), costs(along).ravel().tolist())

    size = sizes[axis]
    # NumPy's geomspace and clip would take longer than the costs of so few values.
    first, last = max(low, size / REACH), min(high, size * REACH)
    found = vertex(first * (last / first) ** SHARES_ALONG)
    if low < found < high:
        found = vertex(found * CLOSE_RATIOS)
    return float(min(max(found, low), high))


def _vertex(values: Sequence[float], cost: Sequence[float]) -> float:
    """Where the parabola through the least of several costs and its neighbours is least, `values`
    being in a geometric series; the first or the last value where that has the least cost."""
    k = min(range(len(cost)), key=cost.__getitem__)
    if not 0 < k < len(values) - 1:
        return values[k]
    before, least, after = cost[k - 1 : k + 2]
    rise = before + after - 2.0 * least
    shift = 0.5 * (before - after) / rise if rise > 0.0 else 0.0
    return values[k] * (values[1] / values[0]) ** shift
