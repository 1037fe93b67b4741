"""Times of tasks that are compared: taken in turns, so that a busy machine slows all alike."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

LEAST_S = 0.02  # of one measurement; shorter tasks are repeated within it
MOST_CALLS = 10_000  # in one measurement


def alternate(
    tasks: dict[str, Callable[[], object]],
    rounds: int,
    clock: Callable[[], float] = time.process_time,
) -> dict[str, np.ndarray]:
    """Seconds (rounds,) of one call of each task.

    Each task is called once untimed, for what it compiles, and once to see how often it has to be
    repeated. Then all tasks are measured in turns, `rounds` times. `clock` is the processor time
    of this process by default, which other processes disturb little.
    """
    calls = {}
    for name, task in tasks.items():
        task()
        start = clock()
        task()
        calls[name] = int(np.clip(LEAST_S / max(clock() - start, 1e-9), 1, MOST_CALLS))
    times: dict[str, list[float]] = {name: [] for name in tasks}
    for _ in range(rounds):
        for name, task in tasks.items():
            start = clock()
            for _ in range(calls[name]):
                task()
            times[name].append((clock() - start) / calls[name])
    return {name: np.array(values) for name, values in times.items()}


def median_ratio(slow: np.ndarray, fast: np.ndarray) -> float:
    """Median over rounds of the ratio within a round."""
    return float(np.median(slow / fast))


def in_words(seconds: float) -> str:
    """A time with two or three digits in a unit that suits it."""
    for unit, size in (("h", 3600.0), ("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds / 1e-9:.3g} ns"
