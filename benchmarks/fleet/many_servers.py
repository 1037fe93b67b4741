"""A queue in the order of arrival, served by several workers that are now and then killed."""

from __future__ import annotations

from dataclasses import dataclass
from heapq import heappop, heappush, heapreplace

import numpy as np

DAY = 86400.0  # s
GRID = 60.0  # s, of the rate of arrivals
BLOCK = 4096  # random numbers drawn at a time


@dataclass(frozen=True)
class Served:
    """What became of n jobs.

    arrival : when each came, s, ascending, shape (n,).
    wait : from there to its end, less the time that it takes when nothing disturbs it, s, (n,).
    entered, begun : when each attempt joined the queue and left it, s, each ascending, (attempts,).
    busy : time that the workers were at work, lost attempts included, s.
    """

    arrival: np.ndarray
    wait: np.ndarray
    entered: np.ndarray
    begun: np.ndarray
    busy: float

    def waiting(self, time: np.ndarray | float) -> np.ndarray:
        """Attempts in the queue at these times (s)."""
        entered = np.searchsorted(self.entered, time, side="right")
        return entered - np.searchsorted(self.begun, time, side="right")


def draw_arrivals(
    rate: float, duration: float, peak: float, rng: np.random.Generator
) -> np.ndarray:
    """Times (s, ascending) of a Poisson process of `duration` (s) with a daily swing.

    rate : mean, 1/s. peak : the highest rate of a day over the mean, 1 to 2; it follows a sine.
    """
    time = np.arange(0.0, duration + GRID, GRID).clip(max=duration)
    swing = (peak - 1.0) * DAY / (2 * np.pi) * (1.0 - np.cos(2 * np.pi * time / DAY))
    expected = rate * (time + swing)
    count = rng.poisson(expected[-1])
    return np.interp(np.sort(rng.uniform(0.0, expected[-1], count)), expected, time)


def serve(
    arrival: np.ndarray,
    service: np.ndarray,
    workers: int,
    kill_rate: float = 0.0,
    rng: np.random.Generator | None = None,
) -> Served:
    """Serve jobs first come, first served.

    arrival : s, ascending, (n,). service : what each takes, s, (n,).
    kill_rate : kills of a worker in a second of its work. A killed job joins the end of the queue
        and begins anew; the worker takes the next one at once. Needs `rng`.
    """
    free = [0.0] * workers  # when each worker has its last job behind it; a heap
    killed: list[tuple[float, int]] = []  # a heap of (when, job)
    finished = np.empty(len(arrival))
    entered, begun = [], []
    busy, following = 0.0, 0
    until_kill = _exponential(kill_rate, rng)
    came, takes = arrival.tolist(), service.tolist()
    # An attempt never joins before one that was served earlier: it joins after that one began.
    while following < len(came) or killed:
        if killed and (following == len(came) or killed[0][0] < came[following]):
            joined, job = heappop(killed)
        else:
            joined, job = came[following], following
            following += 1
        begin = max(joined, free[0])
        lasts = takes[job]
        if kill_rate and (lost := next(until_kill)) < lasts:
            lasts = lost
            heappush(killed, (begin + lost, job))
        else:
            finished[job] = begin + lasts
        heapreplace(free, begin + lasts)
        busy += lasts
        entered.append(joined)
        begun.append(begin)
    wait = np.maximum(finished - arrival - service, 0.0)  # of rounding, where nobody waited
    return Served(arrival, wait, np.array(entered), np.array(begun), busy)


def _exponential(rate, rng):
    while rate:
        yield from rng.exponential(1.0 / rate, BLOCK).tolist()
