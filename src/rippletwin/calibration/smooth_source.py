"""The part of a nominal source's error that is smooth in frequency; see `posterior`."""

from __future__ import annotations

import numpy as np

CORRELATION_HZ = 1000.0  # l and f0 of `posterior`
MIN_HARMONIC = 0.01
"""Share of the strongest harmonic below which a harmonic of the source is uncertain by more than
its own share."""
MIN_EIGENVALUE = 1e-3  # share of the kernel's largest eigenvalue; smaller ones are left out


class SmoothSourceError:
    """Relative error of nominal sources: smooth parts of standard deviation tau, and one of size.

    frequencies   (N,) indices of the frequencies that have it
    basis         (J, N) amplitudes of unit variance times `sds` to relative errors; the last is the
                  size of the ripple

    frequency_hz, recording, scale   (F,) of all frequencies; scale is g
    nominal                          (F,) mask of those with a nominal source
    size_sd                          standard deviation s of the size
    """

    def __init__(self, frequency_hz, recording, nominal, scale, size_sd: float):
        self.frequencies = np.flatnonzero(nominal)
        smooth = smooth_basis(frequency_hz[nominal], recording[nominal])
        size = np.ones((1, smooth.shape[1]))
        self.basis = np.concatenate([scale[nominal] * smooth, size])
        self._size_sd = size_sd

    def sds(self, tau) -> np.ndarray:
        """Standard deviations (..., J) of the amplitudes for tau (...)."""
        sds = np.empty((*np.shape(tau), len(self.basis)))
        sds[..., :-1] = np.asarray(tau)[..., None]
        sds[..., -1] = self._size_sd
        return sds

    def most_likely(self, pull: np.ndarray, tau: float) -> np.ndarray:
        """Most likely error (N,) given the derivative `pull` (F,) of the log likelihood by it."""
        amplitudes = self.sds(tau) ** 2 * (self.basis @ pull[self.frequencies])
        return self.basis.T @ amplitudes


def smooth_basis(frequency_hz: np.ndarray, recording: np.ndarray) -> np.ndarray:
    """Basis (J, N) of errors smooth in frequency, basis.T @ basis = K.

    frequency_hz   (N,)
    recording      (N,) number of the recording that each frequency belongs to

    K is that of `posterior`.
    """
    f = np.asarray(frequency_hz, float) / CORRELATION_HZ
    kernel = 1.0 + (1.0 + np.outer(f, f)) * np.exp(-0.5 * np.subtract.outer(f, f) ** 2)
    kernel = kernel * (0.5 + 0.5 * np.equal.outer(recording, recording))
    values, vectors = np.linalg.eigh(kernel)
    kept = values > MIN_EIGENVALUE * np.max(values, initial=0.0)
    return np.sqrt(values[kept])[:, None] * vectors[:, kept].T


def source_scale(source: np.ndarray) -> np.ndarray:
    """g (F,): size of a ripple around each harmonic over that of the harmonic itself.

    source   (F,) harmonics of the flow ripple in ascending order

    Around means a weighted mean of the power over two neighbours on each side.
    """
    power = np.abs(source) ** 2
    kernel = np.exp(-0.5 * np.arange(-2, 3) ** 2.0)
    around = np.convolve(power, kernel / kernel.sum())[2:-2]
    around = np.maximum(around, power) + MIN_HARMONIC**2 * np.max(power)
    return np.sqrt(around / np.maximum(power, 1e-300))
