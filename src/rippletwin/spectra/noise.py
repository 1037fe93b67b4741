"""Noise of a recording: from the finest wavelet details, and from cycle to cycle."""

from __future__ import annotations

import numpy as np

BLOCK_SAMPLES = 2**18  # of which one median is taken


def noise_mad(signal: np.ndarray) -> np.ndarray:
    """Standard deviation of white noise in `signal` (..., N), in its units, shape (...).

    Median absolute deviation of the finest wavelet details over 0.6745 (Donoho & Johnstone 1994,
    Biometrika 81, 425); the ripple of a pump has next to nothing in that top octave. Of a long
    signal it is the root mean square over blocks.
    """
    import pywt

    count = signal.shape[-1]
    size = count // max(count // BLOCK_SAMPLES, 1)
    squares = []
    for start in range(0, count - size + 1, size):
        details = pywt.dwt(signal[..., start : start + size], "db8", axis=-1)[1]
        squares.append(np.median(np.abs(details), axis=-1) ** 2)
    return np.sqrt(np.mean(squares, axis=0)) / 0.6744897501960817


def noise_cycle_scatter(windows: np.ndarray) -> np.ndarray:
    """Standard deviation (S,) of what does not repeat in `windows` (R, S, M), in their unit.

    Everything that varies from one revolution to the next counts, not only sensor noise.
    """
    residual = windows - windows.mean(axis=0)
    return np.sqrt(np.mean(residual**2, axis=(0, 2)) * len(windows) / (len(windows) - 1))
