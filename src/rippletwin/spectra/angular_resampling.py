"""Tacholess angular resampling: whole revolutions of a recording at equal shaft angles.

The shaft angle is estimated from the ripple itself. Time is a cubic spline t(theta) of the shaft
angle theta (in revolutions), with a knot every quarter of a revolution. In a window of one
revolution around each knot the orders X_k of the ripple are multiplied by exp(2 pi j k e) where the
shaft is ahead of the estimate by e. e is solved by least squares over orders and sensors: first
from the increments of the strong low piston harmonics, which tolerate a wrong nominal speed, then
against the mean orders, up to higher and higher ones. A window of exactly one revolution is blind
to what repeats every revolution: speed fluctuation within a revolution stays in the ripple.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.fft import next_fast_len
from scipy.interpolate import CubicSpline
from scipy.ndimage import map_coordinates, spline_filter1d

from rippletwin.spectra.interpolation_kernel import sum_taps

KNOTS_PER_REVOLUTION = 4
FIRST_PISTON_HARMONICS = 6  # for the first estimate of the angle
MAX_TRACKED_HZ = 5000.0
MIN_TRIMMED_REVOLUTIONS = 20  # more than these lose one at either end, where the angle is uncertain
KERNEL_HALF_WIDTH = 24  # samples; with KERNEL_SHAPE right to 1e-6 up to 0.4 times the sampling rate
KERNEL_SHAPE = 14.0
KERNEL_FRACTIONS = 4096  # of a sample, at which the kernel is tabulated
SIGNIFICANT_POWER = 10.0  # of a mean order over its scatter's, to be tracked
WINDOWS_AT_ONCE = 256  # transformed together, so that memory does not grow with the recording


class NoShaftRippleError(ValueError):
    """No order of the ripple repeats with the shaft, so that nothing tells the shaft's angle."""


@dataclass(frozen=True)
class Revolutions:
    """Whole revolutions at equal shaft angles.

    windows (R, S, M) as the pressure given; speed_hz (R,), the mean of each revolution;
    sampling_rate_hz = M times the mean speed. start is how far, in revolutions, the shaft turns
    from the recording's first sample to the first window.
    """

    windows: np.ndarray
    speed_hz: np.ndarray
    sampling_rate_hz: float
    start: float = 0.0


def cut_revolutions(
    pressure: np.ndarray,
    sampling_rate_hz: float,
    pistons: int,
    speed_rpm: float,
    samples_per_revolution: int | None = None,
) -> Revolutions:
    """Cut `pressure` (S, N) into whole revolutions of equal shaft angle steps.

    The shaft angle of the first sample is unknown. Half a revolution is lost at either end, one
    and a half where there are more than twenty.
    `samples_per_revolution` None keeps the recording's own rate, rounded up to an even number.
    Raises ValueError for fewer than two revolutions left, NoShaftRippleError where no ripple
    repeats with the shaft.
    """
    speed_hz = speed_rpm / 60
    own = 2 * int(np.ceil(sampling_rate_hz / speed_hz / 2))
    step = samples_per_revolution or own
    time = _time_of_angle(pressure, sampling_rate_hz, pistons, speed_hz, own)
    first, last = time.x[0], time.x[-1]
    if last - first > MIN_TRIMMED_REVOLUTIONS:
        first, last = first + 1, last - 1
    count = int(np.floor(last - first))
    if count < 2:
        raise ValueError(f"{pressure.shape[1]} samples hold fewer than two whole revolutions")
    edges = time(first + np.arange(count + 1))
    speed = 1 / np.diff(edges)
    cutoff = min(1.0, float(step * speed.min() / sampling_rate_hz))
    windows = np.empty((count, len(pressure), step))
    for r in range(count):
        angle = first + r + np.arange(step) / step
        windows[r] = interpolate(pressure, time(angle) * sampling_rate_hz, cutoff)
    before = _angles_at_ends(time, (pressure.shape[1] - 1) / sampling_rate_hz)[0]
    rate = step * count / (edges[-1] - edges[0])
    return Revolutions(windows, speed, rate, float(first - before))


def interpolate(signal: np.ndarray, position: np.ndarray, cutoff: float = 1.0) -> np.ndarray:
    """Band-limited values (S, P) of `signal` (S, N) at fractional sample numbers `position` (P,).

    `cutoff` < 1 lowers the band to that share of Nyquist. Beyond its ends the signal is constant.
    """
    return sum_taps(signal, position, *_kernel(cutoff))


@lru_cache(maxsize=4)
def _kernel(cutoff: float) -> tuple[np.ndarray, int]:
    """Weights (KERNEL_FRACTIONS + 1, taps) of the samples around a position at each fraction of a
    sample, and the number of taps before it.

    A sinc windowed by exp(b (sqrt(1 - u^2) - 1)) (Barnett, Magland, af Klinteberg 2019, SIAM J.
    Sci. Comput. 41, C479, eq. 1.8). Linear interpolation between 4096 entries errs by 1e-7.
    """
    half = KERNEL_HALF_WIDTH / cutoff
    before = int(np.ceil(half)) - 1
    distance = np.linspace(0, 1, KERNEL_FRACTIONS + 1)[:, None] - np.arange(-before, before + 2)
    shape = np.sqrt(np.maximum(1 - (distance / half) ** 2, 0.0))
    weight = (
        np.sinc(cutoff * distance) * np.exp(KERNEL_SHAPE * (shape - 1)) * (np.abs(distance) < half)
    )
    return weight / weight.sum(axis=1, keepdims=True), before  # a constant stays constant


def _time_of_angle(
    pressure: np.ndarray, sampling_rate_hz: float, pistons: int, speed_hz: float, step: int
) -> CubicSpline:
    """t(theta), s, over the angles (revolutions) that can be cut."""
    smooth = spline_filter1d(np.asarray(pressure, float), order=3, axis=1, mode="mirror")
    duration = (pressure.shape[1] - 1) / sampling_rate_hz
    angle = np.array([0.0, duration * speed_hz])
    time = CubicSpline(angle, angle / speed_hz)
    step = KNOTS_PER_REVOLUTION * next_fast_len(-(-step // KNOTS_PER_REVOLUTION), real=True)
    highest = min(step // 3, int(MAX_TRACKED_HZ / speed_hz))
    limits = [None] + [min(highest, pistons * 4**n) for n in range(1, 5)]
    for limit in limits:
        orders, centre = _sliding_orders(smooth, sampling_rate_hz, time, step, highest)
        if limit is None:
            ahead = _from_increments(orders, pistons)
        else:
            ahead = _from_mean_orders(orders, limit)
        time = CubicSpline(centre + _smooth(ahead), time(centre))
    return time


def _smooth(ahead: np.ndarray) -> np.ndarray:
    """Average over one revolution.

    To speed changes faster than one a revolution a window of one revolution responds with the wrong
    sign; averaged once more it does not, so that the iteration converges.
    """
    weight = np.array([0.5, 1, 1, 1, 0.5]) / KNOTS_PER_REVOLUTION
    return np.convolve(np.pad(ahead, 2, mode="reflect", reflect_type="odd"), weight, mode="valid")


def _sliding_orders(smooth, sampling_rate_hz, time, step, highest):
    """Orders 0..highest (windows, S, K + 1) of one revolution around each knot, and the knots."""
    last = (smooth.shape[1] - 1) / sampling_rate_hz
    low, high = _angles_at_ends(time, last)
    count = int(np.floor((high - low) * step))
    angle = low + np.arange(count) / step
    position = time(angle) * sampling_rate_hz
    hop = step // KNOTS_PER_REVOLUTION
    starts = np.arange(0, count - step + 1, hop)
    orders = np.empty((starts.size, len(smooth), highest + 1), complex)
    for s, row in enumerate(smooth):
        even = map_coordinates(row, position[None], order=3, prefilter=False, mode="nearest")
        windows, mean = np.lib.stride_tricks.sliding_window_view(even, step)[::hop], row.mean()
        for first in range(0, starts.size, WINDOWS_AT_ONCE):
            some = slice(first, first + WINDOWS_AT_ONCE)
            orders[some, s] = np.fft.rfft(windows[some] - mean, axis=1)[:, : highest + 1]
    # Refer every window to one origin of the angle.
    turn = np.exp(-2j * np.pi * np.outer(angle[starts], np.arange(highest + 1)))
    return orders * turn[:, None, :] * (2 / step), angle[starts] + 0.5


def _angles_at_ends(time: CubicSpline, last: float) -> tuple[float, float]:
    """Shaft angles at the first and the last sample: the spline's ends, continued straight."""
    angles = time.x[[0, -1]]
    return tuple(angles + (np.array([0.0, last]) - time(angles)) / time(angles, 1))


def _from_increments(orders: np.ndarray, pistons: int) -> np.ndarray:
    """Lead of the shaft (windows,), revolutions, from the phase increments between windows."""
    k = pistons * np.arange(1, FIRST_PISTON_HARMONICS + 1)
    k = k[k < orders.shape[2]]
    turn = np.einsum("rsk,rsk->rk", orders[1:, :, k], orders[:-1, :, k].conj())
    weight = k**2 * np.abs(turn)
    increment = (weight * np.angle(turn) / k).sum(1) / weight.sum(1) / (2 * np.pi)
    ahead = np.concatenate([[0.0], np.cumsum(increment)])
    return ahead


def _from_mean_orders(orders: np.ndarray, limit: int) -> np.ndarray:
    """Lead of the shaft against the mean orders 1 to `limit` that exceed their scatter.

    Raises NoShaftRippleError where there is none.
    """
    some = orders[:, :, 1 : limit + 1]
    k = np.arange(1, some.shape[2] + 1)
    mean = some.mean(0)
    scatter = np.mean(np.abs(some - mean) ** 2, axis=0)
    floor = np.median(scatter, axis=1, keepdims=True)
    weight = np.where(
        np.abs(mean) ** 2 > SIGNIFICANT_POWER * floor / len(some) * KNOTS_PER_REVOLUTION, 1.0, 0.0
    )
    if not np.any(weight):
        raise NoShaftRippleError(f"none of the shaft orders up to {limit} repeats")
    # An order whose phase a resonance changes with the speed is no measure of the angle.
    weight = weight / np.maximum(scatter, floor)
    turn = np.einsum("rsk,sk,k->r", some, weight * mean.conj(), k).imag
    return turn / np.sum(weight * np.abs(mean) ** 2 * k**2) / (2 * np.pi)
