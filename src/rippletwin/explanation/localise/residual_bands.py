"""Where the residual exceeds its expected size: frequency bands, shaft angles, operating points.

The excess is known at every harmonic of every operating point. One harmonic says little, so
neighbours are averaged first. The highest values are kept until they hold most of the excess. They
form intervals, which are joined across the narrowest gaps until only a few are left.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from rippletwin.calibration.fit import Fit, posterior_at_fit
from rippletwin.calibration.posterior import Posterior
from rippletwin.explanation.thresholds import LITTLE_MODEL_ERROR

EXCESS_SHARE = 0.9  # of the excess that the intervals hold together
MAX_INTERVALS = 4
GRID_CELLS = 400  # of the frequency grid on which neighbours are averaged
LONE_SPACING_HZ = 1.0
"""Width of that average where each operating point has one frequency, which has no neighbour."""
PITCH_SHARE_AVERAGED = 0.02  # of a piston's pitch, width of the average over shaft angles
MIN_CONCENTRATED_SHARE = 0.2  # of a residual's energy above its median, to be concentrated at all
MAX_MEAN_SQUARE = 4.0  # of the whitened residual at an operating point that does not stand out


def find_frequency_bands(
    frequency_hz: np.ndarray,
    mean_square: np.ndarray,
    spacing_hz: float,
    share: float = EXCESS_SHARE,
) -> list[list[float]]:
    """Frequency bands (Hz), at most MAX_INTERVALS, that hold `share` of a residual's excess.

    frequency_hz  (F,) in any order
    mean_square   (F,) of the whitened residual: 1 where the fit is as good as expected
    spacing_hz    of neighbouring harmonics, over which the excess is averaged

    Empty if nothing exceeds 1; the one frequency where all are the same.
    """
    frequency_hz = np.asarray(frequency_hz, float)
    excess = np.maximum(np.asarray(mean_square) - 1.0, 0.0)
    if not np.any(excess > 0):
        return []
    low, high = float(frequency_hz.min()), float(frequency_hz.max())
    if low == high:
        return [[low, high]]
    grid = np.linspace(low, high, GRID_CELLS)
    weight = np.exp(-0.5 * ((grid[:, None] - frequency_hz) / (0.5 * spacing_hz)) ** 2)
    total = np.sum(weight, axis=1)
    # Between harmonics farther apart than the average is wide, take the nearest one.
    near = np.argmin(np.abs(grid[:, None] - frequency_hz), axis=1)
    smooth = np.where(total > 1e-9, weight @ excess / np.maximum(total, 1e-9), excess[near])
    step = grid[1] - grid[0]
    intervals = find_intervals(smooth, share, min_gap=int(spacing_hz / step))
    return [[float(grid[a]), float(grid[b - 1])] for a, b in intervals]


def find_angle_intervals(
    wave: np.ndarray, pitch_deg: float, share: float = EXCESS_SHARE
) -> list[list[float]]:
    """Shaft angles (deg, within a piston's pitch) that hold `share` of a residual's excess.

    wave (..., M) is the complex residual at M even angles of one pitch, from its one-sided
    spectrum: its square is the squared envelope. The median over angles is subtracted, because a
    constant envelope is no event. An interval across angle 0 is returned as two. Empty if the
    residual is about as strong at all angles.
    """
    energy = np.sum(np.abs(wave.reshape(-1, wave.shape[-1])) ** 2, axis=0)
    count = len(energy)
    lag = np.minimum(np.arange(count), count - np.arange(count)) / count
    kernel = np.exp(-0.5 * (lag / PITCH_SHARE_AVERAGED) ** 2)
    smooth = np.fft.irfft(np.fft.rfft(energy) * np.fft.rfft(kernel / kernel.sum()), count)
    excess = np.maximum(smooth - np.median(smooth), 0.0)
    if np.sum(excess) < MIN_CONCENTRATED_SHARE * np.sum(smooth):
        return []
    # Cut the circle open at the minimum, so that no interval crosses the cut.
    cut = int(np.argmin(smooth))
    step, angles = pitch_deg / count, []
    for a, b in find_intervals(
        np.roll(excess, -cut), share, MAX_INTERVALS - 1, int(PITCH_SHARE_AVERAGED * count)
    ):
        a, b = (a + cut) % count, (b + cut - 1) % count + 1
        angles += [[a, b]] if a < b else [[a, count], [0, b]]
    return sorted([float(a * step), float(b * step)] for a, b in angles)


def find_intervals(
    excess: np.ndarray, share: float, max_count: int = MAX_INTERVALS, min_gap: int = 0
) -> list[tuple[int, int]]:
    """Index intervals [a, b) with at least `share` of an array's (N,) sum.

    At most `max_count` intervals, more than `min_gap` apart.
    """
    order = np.argsort(-excess, kind="stable")
    cumulative = np.cumsum(excess[order])
    inside = np.zeros(len(excess) + 2, int)
    inside[order[: int(np.searchsorted(cumulative, share * cumulative[-1])) + 1] + 1] = 1
    edges = np.flatnonzero(np.diff(inside))
    intervals = [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]
    while len(intervals) > 1:
        gaps = [b[0] - a[1] for a, b in pairwise(intervals)]
        k = int(np.argmin(gaps))
        if len(intervals) <= max_count and gaps[k] > min_gap:
            break
        intervals[k : k + 2] = [(intervals[k][0], intervals[k + 1][1])]
    return intervals


def residual_frequency_bands(fit: Fit, observations: Sequence) -> list[list[float]]:
    """Frequency bands (Hz) in which the fit's whitened residual exceeds its expected size."""
    posterior, r = _whitened_residual(fit, observations)
    frequency = [o.frequency_hz for o in posterior.observations]
    distances = [float(np.median(np.diff(f))) for f in frequency if len(f) > 1]
    spacing = max(distances, default=LONE_SPACING_HZ)
    mean_square = np.mean(np.abs(r) ** 2, axis=0)
    return find_frequency_bands(np.concatenate(frequency), mean_square, spacing)


def residual_conditions(fit: Fit, observations: Sequence) -> list[int]:
    """Indices of the observations in which the fit's residual exceeds its expected size."""
    posterior, r = _whitened_residual(fit, observations)
    mean_squares = [float(np.mean(np.abs(r[:, part]) ** 2)) for part in posterior.forward.slices]
    return [k for k, value in enumerate(mean_squares) if value > MAX_MEAN_SQUARE]


def residual_crank_angles(
    fit: Fit, observations: Sequence, samples: int = 360
) -> list[list[float]]:
    """Shaft angles (deg, within a piston's pitch) at which the fit's residual is concentrated.

    Of periodic recordings whose source is nominal, on the common shaft angle: that of a free source
    is unknown.

    samples   angles of a pitch at which the residual is calculated
    """
    posterior = _posterior(fit, observations)
    prediction = posterior.predict(fit.twin.theta)
    waves, pitch = [], None
    for o, part in zip(posterior.observations, posterior.forward.slices):
        if o.orders is None or o.source == "free":
            continue
        index = fit.twin.index.get(f"angle[{o.label}]")
        turn = 0.0 if index is None else fit.twin.parameters[index].value(fit.twin.theta[index])
        orders = np.asarray(o.orders, float)
        pitch = 2 * np.pi / np.gcd.reduce(np.asarray(o.orders, int))
        residual = (o.values - prediction[:, part]) * np.exp(-1j * turn * orders)
        wave = residual @ np.exp(1j * np.outer(orders, pitch * np.arange(samples) / samples))
        waves.append(wave / np.linalg.norm(o.values))
    return find_angle_intervals(np.concatenate(waves), float(np.rad2deg(pitch))) if waves else []


def residual_map(fit: Fit, observations: Sequence) -> list[np.ndarray]:
    """|whitened residual| (S, F) of each observation: 1 where the fit is as good as expected."""
    posterior, r = _whitened_residual(fit, observations)
    return [np.abs(r[:, part]) for part in posterior.forward.slices]


def interior_misfit(fit: Fit, observations: Sequence) -> list[np.ndarray]:
    """Relative misfit (F,) of p2 from p1 and p3 alone, one array per observation.

    The pressure at an inner sensor follows from two outer ones, whatever the source and the load
    are. Within one segment p2 = [sinh g(L - x) p1 + sinh g x p3]/sinh g L. Through several:

        p2 = A p1 + B p3,  A = T23_12/T13_12,  B = T12_12/T13_12,

    with T_ij the transfer matrix from sensor i to sensor j. Empty for fewer than three sensors.
    """
    if len(fit.twin.rig.sensors) < 3:
        return []
    posterior = _posterior(fit, observations)
    network = posterior.forward.network(fit.twin.theta)
    first, middle, last = np.sort(network.sensor_positions)[[0, 1, -1]]
    rows = np.argsort(network.sensor_positions)[[0, 1, -1]]
    whole = network.transfer(first, last)[:, 0, 1]
    near, far = network.transfer(first, middle)[:, 0, 1], network.transfer(middle, last)[:, 0, 1]
    factor = np.broadcast_to(network.sensor_factor, posterior.values.shape)
    p1, p2, p3 = (posterior.values / factor)[rows]
    error = np.abs(p2 - (far * p1 + near * p3) / whole) / np.sqrt(posterior.power)
    return [error[part] for part in posterior.forward.slices]


def _posterior(fit: Fit, observations: Sequence) -> Posterior:
    return posterior_at_fit(fit, observations, LITTLE_MODEL_ERROR)


def _whitened_residual(fit: Fit, observations: Sequence) -> tuple[Posterior, np.ndarray]:
    posterior = _posterior(fit, observations)
    return posterior, posterior.whitened(posterior.predict(fit.twin.theta))[0]
