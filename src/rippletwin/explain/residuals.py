"""Where a residual lies in frequency and shaft angle: a few stretches, not many.

A residual's excess over what is believed is a number at every harmonic of every operating point.
One harmonic says little, so neighbours are averaged first; of what remains the highest is kept
until it holds most of the excess, and stretches are joined over the narrowest gaps until few are
left.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

SHARE = 0.9  # of the excess that the stretches hold
MOST = 4  # stretches
CELLS = 400  # of the grid on which neighbours are averaged
PITCH_WIDTH = 0.02  # of a piston's pitch over which shaft angles are averaged


def bands(
    frequency_hz: np.ndarray, size: np.ndarray, spacing_hz: float, share: float = SHARE
) -> list[list[float]]:
    """Frequency bands (Hz), at most MOST, that hold `share` of a residual's excess.

    frequency_hz (F,) in any order, size (F,) the mean square of the whitened residual, 1 where the
    fit is as good as believed; spacing_hz between neighbouring harmonics, over which is averaged.
    Empty where nothing is in excess.
    """
    frequency_hz, excess = np.asarray(frequency_hz, float), np.maximum(np.asarray(size) - 1.0, 0.0)
    if not np.any(excess > 0):
        return []
    grid = np.linspace(frequency_hz.min(), frequency_hz.max(), CELLS)
    weight = np.exp(-0.5 * ((grid[:, None] - frequency_hz) / (0.5 * spacing_hz)) ** 2)
    total = np.sum(weight, axis=1)
    # Between harmonics farther apart than is averaged nothing is known: the nearest speaks.
    near = np.argmin(np.abs(grid[:, None] - frequency_hz), axis=1)
    smooth = np.where(total > 1e-9, weight @ excess / np.maximum(total, 1e-9), excess[near])
    step = grid[1] - grid[0]
    found = stretches(smooth, share, gap=int(spacing_hz / step))
    return [[float(grid[a]), float(grid[b - 1])] for a, b in found]


def angles(wave: np.ndarray, pitch_deg: float, share: float = SHARE) -> list[list[float]]:
    """Shaft angles (deg, within a piston's pitch) that hold `share` of a residual's excess.

    wave (..., M) complex: the residual's one-sided spectrum summed over even angles of one pitch,
    whose square is its envelope's, free of the carrier. What it has everywhere alike is no event
    and is taken off. A stretch about angle 0 comes as two. Empty where the residual is as strong
    at all angles.
    """
    energy = np.sum(np.abs(wave.reshape(-1, wave.shape[-1])) ** 2, axis=0)
    count = len(energy)
    lag = np.minimum(np.arange(count), count - np.arange(count)) / count
    kernel = np.exp(-0.5 * (lag / PITCH_WIDTH) ** 2)
    smooth = np.fft.irfft(np.fft.rfft(energy) * np.fft.rfft(kernel / kernel.sum()), count)
    excess = np.maximum(smooth - np.median(smooth), 0.0)
    if np.sum(excess) < 0.2 * np.sum(smooth):
        return []
    # Cut open where the least is, so that no stretch crosses the cut.
    turn = int(np.argmin(smooth))
    step, found = pitch_deg / count, []
    for a, b in stretches(np.roll(excess, -turn), share, MOST - 1, int(PITCH_WIDTH * count)):
        a, b = (a + turn) % count, (b + turn - 1) % count + 1
        found += [[a, b]] if a < b else [[a, count], [0, b]]
    return sorted([float(a * step), float(b * step)] for a, b in found)


def stretches(
    excess: np.ndarray, share: float, most: int = MOST, gap: int = 0
) -> list[tuple[int, int]]:
    """At most `most` runs [a, b), more than `gap` apart, with `share` of an array's (N,) sum."""
    order = np.argsort(-excess, kind="stable")
    held = np.cumsum(excess[order])
    inside = np.zeros(len(excess) + 2, int)
    inside[order[: int(np.searchsorted(held, share * held[-1])) + 1] + 1] = 1
    edges = np.flatnonzero(np.diff(inside))
    runs = [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]
    while len(runs) > 1:
        gaps = [b[0] - a[1] for a, b in pairwise(runs)]
        k = int(np.argmin(gaps))
        if len(runs) <= most and gaps[k] > gap:
            break
        runs[k : k + 2] = [(runs[k][0], runs[k + 1][1])]
    return runs
