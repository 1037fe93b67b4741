"""Cross spectra against a reference sensor, for an unknown broadband source."""

from __future__ import annotations

import numpy as np

from rippletwin.case.model import Rig

ROUND_TRIPS_PER_SEGMENT = 20  # length of a segment of a random recording, in round trips of a wave
REFERENCE_ERROR = 1e-4  # relative, of the reference sensor: nominal
MIN_COHERENT_SHARE = 1e-3  # of the reference's power, to stay positive
OVERLAP_CORRELATION = 1 / 6  # of neighbouring Hann segments that overlap by half


def reference_spectra(
    pressure: np.ndarray, sampling_rate_hz: float, rig: Rig
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cross spectra of `pressure` (S, N) against its first row, for an unknown broadband source.

    Returns values (S, F), covariance (F, S, S), frequency_hz (F,). values[s] = sqrt(G) H_s, where
    G is the power of the coherent signal at the first sensor in a bin and H_s = G_1s / G the
    response from there to sensor s: the H1 estimator (Bendat & Piersol 2010, Random Data, ch. 6).
    The noise, the smallest eigenvalue of the cross-spectral matrix, is subtracted from G; otherwise
    noise of the first sensor would make every H_s too small. The error of sensor s is its scatter
    about H_s times the first sensor, segment by segment; the first sensor's own error is nominal.
    Hann segments overlap by half. Every second bin is kept, so that neighbours are almost
    independent.
    """
    samples = pressure.shape[1]
    round_trip = 2 * rig.delay
    wanted = max(ROUND_TRIPS_PER_SEGMENT * round_trip * sampling_rate_hz, 256)
    length = min(2 ** int(np.ceil(np.log2(wanted))), 2 ** int(np.log2(samples / 8)))
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
    noise = np.linalg.eigvalsh(power)[:, 0]
    coherent = np.maximum(power[:, 0, 0].real - noise, MIN_COHERENT_SHARE * power[:, 0, 0].real)
    values = power[:, :, 0].T / np.sqrt(coherent)
    values[0] = np.sqrt(coherent)
    error = spectra - values / values[0] * spectra[:, :1]
    averages = len(starts) / (1 + 2 * OVERLAP_CORRELATION**2)
    covariance = np.einsum("rsf,rtf->fst", error, error.conj()) / len(starts) / averages
    covariance[:, 0, :] = covariance[:, :, 0] = 0
    covariance[:, 0, 0] = (REFERENCE_ERROR * np.abs(values[0])) ** 2
    return values, covariance, np.fft.rfftfreq(length, 1 / sampling_rate_hz)[2:-2:2]
