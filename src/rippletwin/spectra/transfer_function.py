"""Spectra of an unknown broadband source, from the cross spectra of all sensors."""

from __future__ import annotations

import numpy as np

from rippletwin.case.model import Rig

ROUND_TRIPS_PER_SEGMENT = 20  # length of a segment of a random recording, in round trips of a wave
MIN_SEGMENTS_LONG = 6  # length of a recording in segments, at least
ALONG_ERROR = 1e-4  # relative, along the source, whose amplitude is free: nominal
OVERLAP_CORRELATION = 1 / 6  # of neighbouring Hann segments that overlap by half


def coherent_spectra(
    pressure: np.ndarray, sampling_rate_hz: float, rig: Rig
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What one source makes of `pressure` (S, N), in amplitude and phase against the first sensor.

    Returns values (S, F), covariance (F, S, S), frequency_hz (F,). The cross-spectral matrix of one
    source is a dyad v v^H; noise of equal power at all sensors adds a multiple of the unit matrix
    and leaves its first eigenvector (Bendat & Piersol 2010, Random Data, ch. 8). values are v, the
    noise subtracted from its power, with a real first row. A ratio to one sensor, the H1 estimator,
    is too small where that sensor is at a node of the standing wave.

    The error is the scatter of the segments about multiples of v, across v; along v it is nominal.
    Hann segments overlap by half. Every second bin is kept, so that neighbours are almost
    independent.
    """
    sensors, samples = pressure.shape
    round_trip = 2 * rig.delay
    wanted = max(ROUND_TRIPS_PER_SEGMENT * round_trip * sampling_rate_hz, 256)
    longest = max(samples / MIN_SEGMENTS_LONG, 8)
    length = 2 ** int(min(np.ceil(np.log2(wanted)), np.log2(longest)))
    window = np.hanning(length + 1)[:-1]
    starts = np.arange(0, samples - length + 1, length // 2)
    scale = 2 / window.sum()
    spectra = np.array(
        [
            scale * np.fft.rfft(window * (part - part.mean(1, keepdims=True)), axis=1)[:, 2:-2:2]
            for part in (pressure[:, start : start + length] for start in starts)
        ]
    )
    power = np.einsum("rsf,rtf->fst", spectra, spectra.conj()) / len(starts)
    eigenvalues, vectors = np.linalg.eigh(power)
    noise = eigenvalues[:, 0] if sensors > 1 else 0.0
    first = vectors[:, :, -1].T  # (S, F)
    first = first * np.exp(-1j * np.angle(first[0]))
    values = np.sqrt(eigenvalues[:, -1] - noise) * first
    across = spectra - first * np.einsum("sf,rsf->rf", first.conj(), spectra)[:, None]
    averages = len(starts) / (1 + 2 * OVERLAP_CORRELATION**2)
    covariance = np.einsum("rsf,rtf->fst", across, across.conj()) / len(starts) / averages
    covariance += ALONG_ERROR**2 * np.einsum("sf,tf->fst", values, values.conj())
    return values, covariance, np.fft.rfftfreq(length, 1 / sampling_rate_hz)[2:-2:2]
