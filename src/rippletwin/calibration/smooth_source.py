"""The part of a nominal source's error that is smooth in frequency; see `reading_errors`."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass

import numpy as np

CORRELATION_HZ = 1000.0  # l and f0 of `reading_errors`
MIN_HARMONIC = 0.01
"""Share of the strongest harmonic below which a harmonic of the source is uncertain by more than
its own share."""
LEAST_RATIO = 0.01  # of a measured to the nominal harmonic: below, noise may make it nothing
FIRST_SMOOTH_SD, FIRST_INDEPENDENT_SD = 0.3, 0.1
"""tau and sigma before any are estimated: those of pumps whose relief grooves and free air the data
sheet does not state."""
MIN_EIGENVALUE = 1e-3  # share of the kernel's largest eigenvalue; smaller ones are left out


@dataclass(frozen=True)
class SourceExpansion:
    """The factor of a source with a smooth error, to first order about a value eps_0 of it:

        exp(eps) = mean + factor eps,   factor = exp(eps_0),   mean = factor (1 - eps_0).

    amplitudes     (J,) complex, those of eps_0
    factor, mean   (F,) complex; 1 at a frequency without a smooth error
    """

    amplitudes: np.ndarray
    factor: np.ndarray
    mean: np.ndarray


class SmoothSourceError:
    """Errors eps of nominal sources: smooth ones of standard deviation tau, and one of size.

    frequencies   (N,) indices of the frequencies that have it
    basis         (J, N) amplitudes of unit variance times `sds` to errors eps; the last is the size
                  of the ripple

    frequency_hz, recording   (F,) of all frequencies
    nominal                   (F,) mask of those with a nominal source
    size_sd                   standard deviation s, relative, of the size
    """

    def __init__(self, frequency_hz, recording, nominal, size_sd: float):
        self.frequencies = np.flatnonzero(nominal)
        smooth = smooth_basis(frequency_hz[nominal], recording[nominal])
        self.basis = np.concatenate([smooth, np.ones((1, smooth.shape[1]))])
        self._recording = np.asarray(recording)[nominal]
        self.size_sd, self._count = size_sd, len(nominal)

    def sds(self, tau) -> np.ndarray:
        """Standard deviations (..., J), relative, of the amplitudes for tau (...)."""
        sds = np.empty((*np.shape(tau), len(self.basis)))
        sds[..., :-1] = np.asarray(tau)[..., None]
        sds[..., -1] = self.size_sd
        return sds

    def without_size(self) -> SmoothSourceError:
        """The same errors but for that of the size."""
        other = copy(self)
        other.size_sd = 0.0
        return other

    def most_likely(self, pull: np.ndarray, tau: float) -> np.ndarray:
        """Most likely amplitudes (J,) given the derivative `pull` (F,) of the log likelihood by the
        relative error."""
        return self.sds(tau) ** 2 * (self.basis @ pull[self.frequencies])

    def error(self, amplitudes: np.ndarray) -> np.ndarray:
        """eps (F,), relative, of amplitudes (J,); 0 at a frequency without a smooth error."""
        error = np.zeros(self._count, complex)
        error[self.frequencies] = amplitudes @ self.basis
        return error

    def expand(self, amplitudes: np.ndarray) -> SourceExpansion:
        """The expansion about the error of amplitudes (J,)."""
        error = self.error(amplitudes)
        return SourceExpansion(amplitudes, np.exp(error), np.exp(error) * (1.0 - error))

    def without_error(self) -> SourceExpansion:
        """The expansion about no error."""
        return self.expand(np.zeros(len(self.basis), complex))

    def expand_near(self, ratio: np.ndarray, variance: np.ndarray) -> SourceExpansion:
        """The expansion about the smooth part of the measured over the nominal source.

        ratio, variance   (F,) complex ratio and its relative variance

        Along each recording the phase is continued from harmonic to harmonic: without that, the
        error of a source that turns by more than half a turn would be taken for a small one.
        """
        at = self.frequencies
        ratio = ratio[at]
        phase = np.angle(ratio)
        for recording in np.unique(self._recording):
            own = self._recording == recording
            phase[own] = np.unwrap(phase[own])
        error = np.log(np.maximum(np.abs(ratio), LEAST_RATIO)) + 1j * phase
        columns = self.basis / (FIRST_INDEPENDENT_SD**2 + variance[at])
        precision = columns @ self.basis.T + np.diag(self.sds(FIRST_SMOOTH_SD) ** -2.0)
        return self.expand(np.linalg.solve(precision, columns @ error))


def smooth_basis(frequency_hz: np.ndarray, recording: np.ndarray) -> np.ndarray:
    """Basis (J, N) of errors smooth in frequency, basis.T @ basis = K.

    frequency_hz   (N,)
    recording      (N,) number of the recording that each frequency belongs to

    K is that of `reading_errors`.
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
