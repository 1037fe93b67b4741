"""Synchrosqueezed images of periodic windows: the input of the time-frequency networks.

The chain is the paper's: synchrosqueezed wavelet transform (Daubechies, Lu, Wu 2011) with a Morse
wavelet, the band below ten times the pumping frequency, magnitudes scaled, ``exp(k S)``,
logarithmic frequency axis, linear interpolation to ``size x size``.

The transform is our own because a window of whole revolutions is periodic and only a narrow band is
needed: its spectrum has a few hundred lines. Folding them onto ``COLUMNS`` bins before the inverse
transform gives the wavelet coefficients at ``COLUMNS`` equidistant times exactly (sampling in time
is folding in frequency), with a twentieth of the work. Energy whose instantaneous frequency lies
outside the band is dropped, not clamped to the edge rows.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import NamedTuple

import numba
import numpy as np
import scipy.fft
from scipy.special import gamma as gamma_function

GAMMA, BETA = 3.0, 60.0  # Morse wavelet exp(-w^GAMMA) w^BETA, the convention of ssqueezepy and jLab
COLUMNS = 256  # instants at which the transform is taken
MARGIN_OCTAVES = 0.6  # beyond the band's edges: wavelets there can have energy inside the band
MIN_RESPONSE = 1e-8  # of a wavelet over its peak; spectrum lines below it are omitted
MIN_COEFFICIENT = 1e-6  # over a window's largest; smaller ones have no meaningful frequency
MANY_SIGNALS = 512  # from so many on, a faster inverse FFT is worth the seconds of torch's import

_InverseFft = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class SstSettings:
    """Band, resolution and scaling of an image."""

    size: int = 256  # pixels a side
    max_frequency_hz: float = 1500.0  # ten times the pumping frequency
    min_frequency_hz: float = 12.0  # below the shaft frequency
    scale: float = 1.0  # 1/Pa or s/m3: multiplies the amplitudes
    k: float = 1.0  # of exp(k S)
    voices: int = 32  # wavelets, and rows before interpolation, in an octave


def sst_images(windows: np.ndarray, sampling_rate_hz: float, settings: SstSettings) -> np.ndarray:
    """exp(k S) images: (n, channels, M) -> (n, channels, size, size) float32.

    windows : whole revolutions, Pa or m3/s, so that the end joins the beginning.
    Rows rise in frequency, columns in time (``image_axes``). A pixel without energy is exp(0) = 1.
    Raises ValueError where the band does not fit the sampling rate.
    """
    windows = np.asarray(windows)
    images = np.empty((*windows.shape[:-1], settings.size, settings.size), dtype=np.float32)
    flat = images.reshape(-1, settings.size, settings.size)
    signals = windows.reshape(-1, windows.shape[-1])
    bank = _filter_bank(windows.shape[-1], float(sampling_rate_hz), settings)
    inverse = _inverse_fft(len(signals))
    step = 64  # signals at a time, whose spectrograms fit into the cache
    for start in range(0, len(signals), step):
        part = _transform(signals[start : start + step], bank, inverse)
        flat[start : start + step] = transform_images(part, settings)
    return images


def transform_images(transform: np.ndarray, settings: SstSettings) -> np.ndarray:
    """exp(k S) of a transform (n, rows, COLUMNS) as images (n, size, size) float32."""
    rows = _resize(transform.shape[-2], settings.size)
    columns = np.ascontiguousarray(_resize(COLUMNS, settings.size).T)
    picture = np.exp(np.float32(settings.k * settings.scale) * np.abs(transform))
    return rows @ (picture @ columns)


def amplitude_scale(windows: np.ndarray, sampling_rate_hz: float, settings: SstSettings) -> float:
    """The ``scale`` that maps the largest amplitude in ``windows`` (n, channels, M) to one.

    Determine it once, on simulated healthy windows, and use it for every class and recording.
    """
    signals = np.asarray(windows).reshape(-1, np.shape(windows)[-1])
    return 1.0 / float(np.abs(synchrosqueeze(signals, sampling_rate_hz, settings)).max())


def synchrosqueeze(
    signals: np.ndarray, sampling_rate_hz: float, settings: SstSettings
) -> np.ndarray:
    """Synchrosqueezed transform (n, rows, COLUMNS) complex64 of real periodic signals (n, M).

    Rows are ``frequency_axis(settings)``, columns the times ``arange(COLUMNS) / COLUMNS`` of the
    window. A tone of amplitude A gives magnitude A in its row; the real part summed over rows is
    the signal, within the band, at those times.
    """
    signals = np.asarray(signals)
    bank = _filter_bank(signals.shape[-1], float(sampling_rate_hz), settings)
    return _transform(signals, bank, _inverse_fft(len(signals)))


def _transform(signals: np.ndarray, bank: _FilterBank, inverse: _InverseFft) -> np.ndarray:
    """Synchrosqueezed transform with the wavelets of a bank."""
    spectrum = scipy.fft.rfft(signals, axis=-1)[:, : len(bank.lines)] * (2 / signals.shape[-1])
    out = np.zeros((len(signals), len(bank.edges) - 1, COLUMNS), dtype=np.complex64)
    folded = np.empty((2, len(bank.weights), COLUMNS), dtype=np.complex64)
    for signal, image in zip(spectrum.astype(np.complex64), out):
        _fold(signal, bank.weights, bank.first, bank.last, bank.lines, folded)
        coefficients = inverse(folded)
        _reassign(coefficients[0], coefficients[1], bank.edges, image)
    return out


def _inverse_fft(count: int) -> _InverseFft:
    """The inverse FFT, unnormalised, along the last axis, for the transforms of `count` signals. At
    this length torch's (MKL) is up to three times as fast as scipy's."""
    if count < MANY_SIGNALS:
        return partial(scipy.fft.ifft, norm="forward")
    import torch

    return lambda folded: torch.fft.ifft(torch.from_numpy(folded), norm="forward").numpy()


class _FilterBank(NamedTuple):
    """Wavelets of a band in the frequency domain, for windows of one length.

    lines         (L,) Hz, of the spectrum, up to the last that a wavelet sees
    weights       (A, L) responses over the sum of responses that a tone meets
    first, last   (A,) the lines that each wavelet sees
    edges         (rows + 1,) Hz, between the rows
    """

    lines: np.ndarray
    weights: np.ndarray
    first: np.ndarray
    last: np.ndarray
    edges: np.ndarray


@lru_cache(maxsize=4)  # the same for all windows of a dataset
def _filter_bank(points: int, sampling_rate_hz: float, settings: SstSettings) -> _FilterBank:
    frequency, centre = frequency_axis(settings), _wavelets(settings)
    if centre[-1] >= sampling_rate_hz / 2:
        raise ValueError(
            f"max_frequency_hz {settings.max_frequency_hz:g} needs a sampling rate above "
            f"{2 * centre[-1]:g} Hz, got {sampling_rate_hz:g}"
        )
    lines = np.arange(points // 2 + 1) * sampling_rate_hz / points
    # Morse wavelet in the frequency domain, peak one at its centre frequency
    ratio = lines[1:] / centre[:, None]
    response = np.exp(BETA * np.log(ratio) + BETA / GAMMA * (1 - ratio**GAMMA))
    response = np.pad(response, ((0, 0), (1, 0)))  # no wavelet sees the mean
    seen = response > MIN_RESPONSE
    first, last = seen.argmax(1), seen.shape[1] - seen[:, ::-1].argmax(1)
    used = last.max()
    # sum of the responses over wavelets: what one tone collects (an integral over log scale)
    step = np.log(centre[1] / centre[0])
    peak_frequency = (BETA / GAMMA) ** (1 / GAMMA)
    collected = (
        np.exp(BETA / GAMMA) * peak_frequency**-BETA * gamma_function(BETA / GAMMA) / GAMMA / step
    )
    edges = frequency[0] * np.exp(step * (np.arange(len(frequency) + 1) - 0.5))
    weights = response[:, :used] / collected
    single = np.float32
    return _FilterBank(
        lines[:used].astype(single), weights.astype(single), first, last, edges.astype(single)
    )


def frequency_axis(settings: SstSettings) -> np.ndarray:
    """Row frequencies before interpolation (rows,), Hz, logarithmic from edge to edge."""
    low, high = settings.min_frequency_hz, settings.max_frequency_hz
    if not 0 < low < high:
        raise ValueError(f"the band must be positive and rising, got {low:g} to {high:g} Hz")
    return np.geomspace(low, high, 1 + int(np.ceil(settings.voices * np.log2(high / low))))


def image_axes(settings: SstSettings, duration: float) -> tuple[np.ndarray, np.ndarray]:
    """Pixel centres: frequency (size,), Hz, of an image's rows and time (size,), s, of columns."""
    frequency = frequency_axis(settings)
    pixel = (np.arange(settings.size) + 0.5) / settings.size
    row = np.clip(pixel * len(frequency) - 0.5, 0, len(frequency) - 1)
    return (
        np.exp(np.interp(row, np.arange(len(frequency)), np.log(frequency))),
        (pixel - 0.5 / COLUMNS) * duration,
    )


def _wavelets(settings: SstSettings) -> np.ndarray:
    """Centre frequencies: the rows' grid, continued by the margin on either side."""
    frequency = frequency_axis(settings)
    step = np.log2(frequency[1] / frequency[0])
    extra = int(np.ceil(MARGIN_OCTAVES / step))
    return frequency[0] * 2.0 ** (step * np.arange(-extra, len(frequency) + extra))


def _resize(source: int, target: int) -> np.ndarray:
    """(target, source) linear interpolation between pixel centres; a triangle as wide as a target
    pixel where the image shrinks, so that every source pixel counts."""
    width = max(source / target, 1.0)
    centre = (np.arange(target) + 0.5) * source / target - 0.5
    weight = np.clip(1 - np.abs(np.arange(source) - centre[:, None]) / width, 0, None)
    return (weight / weight.sum(1, keepdims=True)).astype(np.float32)


@numba.njit(cache=True)
def _fold(spectrum, weights, first, last, frequency, folded):
    """Wavelet-weighted lines, and their time derivative over 2 pi j, summed modulo COLUMNS."""
    folded[:] = 0
    columns = folded.shape[-1]
    for a in range(weights.shape[0]):
        for line in range(first[a], last[a]):
            value = weights[a, line] * spectrum[line]
            folded[0, a, line % columns] += value
            folded[1, a, line % columns] += value * frequency[line]


@numba.njit(cache=True, fastmath=True)
def _reassign(coefficient, derivative, edges, out):
    """Add each coefficient to the row whose edges enclose its frequency Re(W' conj W) / |W|^2."""
    rows = out.shape[0]
    largest = 0.0
    for a in range(coefficient.shape[0]):
        for t in range(coefficient.shape[1]):
            w = coefficient[a, t]
            largest = max(largest, w.real * w.real + w.imag * w.imag)
    silent = largest * MIN_COEFFICIENT**2
    for a in range(coefficient.shape[0]):
        row = rows // 2  # search from the last instant's row, which is cheaper than a logarithm
        for t in range(coefficient.shape[1]):
            w, d = coefficient[a, t], derivative[a, t]
            power = w.real * w.real + w.imag * w.imag
            if power <= silent:
                continue
            frequency = d.real * w.real + d.imag * w.imag  # times power
            while row < rows and frequency >= edges[row + 1] * power:
                row += 1
            while row >= 0 and frequency < edges[row] * power:
                row -= 1
            if 0 <= row < rows:
                out[row, t] += w
            row = min(max(row, 0), rows - 1)


def image_similarity(first: np.ndarray, second: np.ndarray) -> tuple[float, float]:
    """Normalised correlation of two images, and the second's amplitude over the first's.

    first, second : (channels, rows, columns), zero where there is no energy, columns a whole number
    of revolutions. Correlation sum(a b) / sqrt(sum(a^2) sum(b^2)), largest over cyclic shifts of
    the second in time (the same for all channels), since neither crank angle is known. One for
    images that differ by a factor only, zero where no ridge meets another (energies have no sign);
    the factor is the second number, the ratio of root mean squares. Raises ValueError for an
    image without energy.
    """
    first, second = np.asarray(first, dtype=float), np.asarray(second, dtype=float)
    energies = np.square(first).sum(), np.square(second).sum()
    if not all(energies):
        raise ValueError("an image without energy has no likeness")
    # correlation over all shifts at once: a product of spectra along time
    product = np.fft.rfft(first).conj() * np.fft.rfft(second)
    correlation = np.fft.irfft(product.sum((0, 1)), first.shape[-1])
    return (
        float(correlation.max() / np.sqrt(energies[0] * energies[1])),
        float(np.sqrt(energies[1] / energies[0])),
    )
