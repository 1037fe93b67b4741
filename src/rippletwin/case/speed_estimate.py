"""The pump's speed as its ripple shows it, without a tachometer."""

from __future__ import annotations

import numpy as np

HARMONICS = 12  # of the nominal speed; every candidate is seen up to the same frequency
SEARCH = (0.5, 2.0)
CONTRAST = 5.0
BLOCK_SAMPLES = 2**19  # transformed at once; of it half a minute is seen at 20 kHz


def estimate_speed(
    pressure: np.ndarray, sampling_rate_hz: float, pistons: int, speed_rpm: float
) -> float | None:
    """The speed (r/min) whose piston harmonics hold most of the ripple; None where there is none.

    `pressure` (S, N). Candidates from half to twice `speed_rpm` are scored by the power in their
    piston harmonics up to the twelfth of `speed_rpm`. The nominal speed wins ties: half the true
    speed scores as well as the true one, so a candidate's odd harmonics must hold power too.
    """
    frequency, power = _spectrum(pressure, sampling_rate_hz)
    # every candidate's harmonics are averaged over +-0.3 %, the wander of a shaft
    candidates = speed_rpm * np.exp(np.arange(np.log(SEARCH[0]), np.log(SEARCH[1]), 1e-3))
    fundamental = candidates * pistons / 60
    numbers = np.arange(1, int(HARMONICS / SEARCH[0]) + 1)
    seen = np.outer(numbers, candidates) <= 1.01 * HARMONICS * speed_rpm
    bands = seen * np.array(
        [_band_power(frequency, power, h * fundamental, 0.003) for h in numbers]
    )
    total = np.sum(power)
    odd, even = bands[0::2].sum(0), bands[1::2].sum(0)
    score = np.where(odd > 1e-3 * even, odd + even, 0.0)
    best = int(np.argmax(score))
    near = np.abs(candidates / speed_rpm - 1) <= 0.01
    if score[near].max() > 0.5 * score[best]:
        best = np.flatnonzero(near)[np.argmax(score[near])]
    width = 2 * 0.003 * fundamental[best] * np.sum(numbers[seen[:, best]])
    background = total * width / (sampling_rate_hz / 2)
    return float(candidates[best]) if score[best] > CONTRAST * background else None


def _spectrum(pressure: np.ndarray, sampling_rate_hz: float) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies (F,) and power (F,) over all sensors.

    A long recording is transformed in blocks whose powers are added (Welch 1967, IEEE Trans. Audio
    Electroacoust. 15, 70, without overlap), so that memory does not grow with it.
    """
    samples = pressure.shape[1]
    blocks = max(samples // BLOCK_SAMPLES, 1)
    size = samples // blocks
    window = np.hanning(size)
    power = np.zeros(size // 2 + 1)
    for row in pressure:
        for start in range(0, blocks * size, size):
            block = row[start : start + size]
            power += np.abs(np.fft.rfft((block - np.mean(block, dtype=float)) * window)) ** 2
    return np.fft.rfftfreq(size, 1 / sampling_rate_hz), power


def _band_power(frequency, power, centre, relative_width):
    """Power of the bins within centre (1 +- relative_width), at least one bin either side."""
    step = frequency[1]
    cumulative = np.concatenate([[0.0], np.cumsum(power)])
    half = np.maximum(relative_width * centre, 1.5 * step)
    low = np.clip(np.ceil((centre - half) / step), 0, power.size).astype(int)
    high = np.clip(np.floor((centre + half) / step) + 1, 0, power.size).astype(int)
    return cumulative[high] - cumulative[low]
