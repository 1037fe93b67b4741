"""Where a residual lies in frequency and shaft angle: a few stretches, not many.

A residual's excess over what is believed is a number at every harmonic of every operating point.
One harmonic says little, so neighbours are averaged first; of what remains the highest is kept
until it holds most of the excess, and stretches are joined over the narrowest gaps until few are
left.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from rippletwin.calibration.fit import Fit, posterior_at_fit
from rippletwin.calibration.posterior import MIN_MODEL_ERROR, Posterior

EXCESS_SHARE = 0.9  # of the excess that the stretches hold
MAX_STRETCHES = 4  # stretches
GRID_CELLS = 400  # of the grid on which neighbours are averaged
PITCH_SHARE_AVERAGED = 0.02  # of a piston's pitch over which shaft angles are averaged


def frequency_stretches(
    frequency_hz: np.ndarray, size: np.ndarray, spacing_hz: float, share: float = EXCESS_SHARE
) -> list[list[float]]:
    """Frequency bands (Hz), at most MAX_STRETCHES, that hold `share` of a residual's excess.

    frequency_hz (F,) in any order, size (F,) the mean square of the whitened residual, 1 where the
    fit is as good as believed; spacing_hz between neighbouring harmonics, over which is averaged.
    Empty where nothing is in excess.
    """
    frequency_hz, excess = np.asarray(frequency_hz, float), np.maximum(np.asarray(size) - 1.0, 0.0)
    if not np.any(excess > 0):
        return []
    grid = np.linspace(frequency_hz.min(), frequency_hz.max(), GRID_CELLS)
    weight = np.exp(-0.5 * ((grid[:, None] - frequency_hz) / (0.5 * spacing_hz)) ** 2)
    total = np.sum(weight, axis=1)
    # Between harmonics farther apart than is averaged nothing is known: the nearest speaks.
    near = np.argmin(np.abs(grid[:, None] - frequency_hz), axis=1)
    smooth = np.where(total > 1e-9, weight @ excess / np.maximum(total, 1e-9), excess[near])
    step = grid[1] - grid[0]
    found = stretches(smooth, share, gap=int(spacing_hz / step))
    return [[float(grid[a]), float(grid[b - 1])] for a, b in found]


def angle_stretches(
    wave: np.ndarray, pitch_deg: float, share: float = EXCESS_SHARE
) -> list[list[float]]:
    """Shaft angles (deg, within a piston's pitch) that hold `share` of a residual's excess.

    wave (..., M) complex: the residual's one-sided spectrum summed over even angles of one pitch,
    whose square is its envelope's, free of the carrier. What it has everywhere alike is no event
    and is taken off. A stretch about angle 0 comes as two. Empty where the residual is as strong
    at all angles.
    """
    energy = np.sum(np.abs(wave.reshape(-1, wave.shape[-1])) ** 2, axis=0)
    count = len(energy)
    lag = np.minimum(np.arange(count), count - np.arange(count)) / count
    kernel = np.exp(-0.5 * (lag / PITCH_SHARE_AVERAGED) ** 2)
    smooth = np.fft.irfft(np.fft.rfft(energy) * np.fft.rfft(kernel / kernel.sum()), count)
    excess = np.maximum(smooth - np.median(smooth), 0.0)
    if np.sum(excess) < 0.2 * np.sum(smooth):
        return []
    # Cut open where the least is, so that no stretch crosses the cut.
    turn = int(np.argmin(smooth))
    step, found = pitch_deg / count, []
    for a, b in stretches(
        np.roll(excess, -turn), share, MAX_STRETCHES - 1, int(PITCH_SHARE_AVERAGED * count)
    ):
        a, b = (a + turn) % count, (b + turn - 1) % count + 1
        found += [[a, b]] if a < b else [[a, count], [0, b]]
    return sorted([float(a * step), float(b * step)] for a, b in found)


def stretches(
    excess: np.ndarray, share: float, most: int = MAX_STRETCHES, gap: int = 0
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


def residual_frequency_bands(fit: Fit, observations: Sequence) -> list[list[float]]:
    """Frequency bands (Hz) in which the fit's whitened residual stands out."""
    posterior, r = _whitened(fit, observations)
    frequency = [o.frequency_hz for o in posterior.observations]
    spacing = max(float(np.median(np.diff(f))) for f in frequency if len(f) > 1)
    return frequency_stretches(np.concatenate(frequency), np.mean(np.abs(r) ** 2, axis=0), spacing)


def residual_conditions(fit: Fit, observations: Sequence) -> list[int]:
    """Indices of the operating points at which the fit's residual stands out."""
    posterior, r = _whitened(fit, observations)
    sizes = [float(np.mean(np.abs(r[:, part]) ** 2)) for part in posterior.forward.slices]
    return [k for k, size in enumerate(sizes) if size > 4.0]


def residual_crank_angles(
    fit: Fit, observations: Sequence, samples: int = 360
) -> list[list[float]]:
    """Shaft angles (deg, within a piston's pitch) where the residual's ripple is concentrated,
    of periodic recordings on the common shaft angle."""
    posterior = _posterior(fit, observations)
    prediction = posterior.predict(fit.twin.theta)
    waves, pitch = [], None
    for o, part in zip(posterior.observations, posterior.forward.slices):
        if o.orders is None:
            continue
        index = fit.twin.index.get(f"angle[{o.label}]")
        turn = 0.0 if index is None else fit.twin.parameters[index].value(fit.twin.theta[index])
        orders = np.asarray(o.orders, float)
        pitch = 2 * np.pi / np.gcd.reduce(np.asarray(o.orders, int))
        residual = (o.values - prediction[:, part]) * np.exp(-1j * turn * orders)
        wave = residual @ np.exp(1j * np.outer(orders, pitch * np.arange(samples) / samples))
        waves.append(wave / np.linalg.norm(o.values))
    return angle_stretches(np.concatenate(waves), float(np.rad2deg(pitch))) if waves else []


def residual_map(fit: Fit, observations: Sequence) -> list[np.ndarray]:
    """|whitened residual| (S, F) of each observation, unit where the fit is as good as believed."""
    posterior, r = _whitened(fit, observations)
    return [np.abs(r[:, part]) for part in posterior.forward.slices]


def interior_test(observations: Sequence, fit: Fit) -> list[np.ndarray]:
    """Relative misfit (F,) of p2 from p1 and p3 alone in each observation of three sensors.

    p2 = [sinh g(L - x) p1 + sinh g x p3]/sinh g L holds whatever source and load are (between two
    sensors of one segment; through several, the same relation of their transfer matrices):

        p2 = A p1 + B p3,  A = T23_12/T13_12,  B = T12_12/T13_12,

    T_ij being the matrix from sensor i to j. Empty where there are fewer sensors.
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
    return posterior_at_fit(fit, observations, MIN_MODEL_ERROR)


def _whitened(fit: Fit, observations: Sequence):
    posterior = _posterior(fit, observations)
    return posterior, posterior.whitened(posterior.predict(fit.twin.theta))[0]
