"""Harmonics at the mean speed from revolutions of varying speed, by Gaussian process regression.

A line responds differently at another speed: over a path of 5 m of oil 0.3 % of speed changes the
phase at 5 kHz by half a radian. A resonance can be narrower than the range of speeds, so that the
mean over the revolutions is the response at no speed at all. Each order of each sensor is therefore
modelled as a smooth function of the speed, and its value at the mean speed is estimated by Gaussian
process regression (Rasmussen & Williams 2006, Gaussian Processes for Machine Learning, sec. 2.2 and
2.7). Width and variance of the function are chosen for each by the restricted likelihood (Patterson
& Thompson 1971, Biometrika 58, 545).

A resonance also depends on the speed's rate of change. Where the angular frequency w rises at the
rate r, a system with response H responds as exp(-j r/2 d^2/dw^2) H(w) (expand H about w under the
integral over a linear chirp; its first term is in Carson & Fry 1937, Bell Syst. Tech. J. 16, 513).
This operator transforms a Gaussian covariance of H into another Gaussian of complex width, in
closed form, so that the covariance below includes it.

A regression over R revolutions costs R^3. A long recording is therefore regressed in blocks: every
n-th revolution belongs to one block, so that each block has all of the speeds. The blocks share one
width and one variance, which maximise the sum of their likelihoods. Their values are averaged.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

from rippletwin.spectra.response_covariance import factor_covariance, response_covariance

MIN_REVOLUTIONS = 8  # for the regression; of fewer the mean is taken
WIDTHS = 1e-4 * 2.0 ** np.arange(9)  # candidates: relative speed over which an order changes
VARIANCE_RATIOS = 10.0 ** np.arange(-1, 8)  # candidates: variance of the function over the noise's
BANDS_PER_OCTAVE = 3  # in each of which one rate of change of the frequency is used
MIN_GAIN = 5.0  # of log likelihood, for an order to depend on the speed
MIN_CORRELATION = 3.0  # of neighbouring residuals, in standard errors, to be believed
MAX_CORRELATION = 0.98  # beyond which the noise of a mean is not increased
MAX_REVOLUTIONS_TOGETHER = 256  # in one regression; more are regressed in blocks
MAX_BLOCK_REVOLUTIONS = 128
MIN_SIZE = 1e-12  # of an eigenvalue, of responses of unit variance


def regress_to_mean_speed(
    spectra: np.ndarray,
    speed_hz: np.ndarray,
    orders: np.ndarray,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Values (S, F) at the mean speed of spectra (R, S, F), and their covariance (F, S, S).

    speed_hz (R,) of the revolutions, which follow each other; orders (F,) from 1. The covariance is
    that of the scatter about the function of speed plus that of the function itself. The scatter is
    averaged with the sensors' typical noise, weighted as S + 2 revolutions, which keeps it positive
    definite where there are few revolutions. `progress` is called with the number of frequency
    bands that are regressed, and of all of them.
    """
    count, sensors, _ = spectra.shape
    data = spectra.reshape(count, -1)
    weights = np.full((data.shape[1], count), 1 / count, dtype=complex)
    unknown = np.zeros(data.shape[1])
    residual = data - data.mean(axis=0)
    freedom = max(count - 1, 1)
    if count >= MIN_REVOLUTIONS:
        mean = mean_speed(speed_hz)
        deviation = speed_hz / mean - 1
        rate = np.gradient(deviation, np.cumsum(1 / speed_hz))
        band = np.tile(np.round(BANDS_PER_OCTAVE * np.log2(orders * mean)).astype(int), sensors)
        bands = np.unique(band)
        for done, each in enumerate(bands, 1):
            own, chirp = (
                np.flatnonzero(band == each),
                rate / (4 * np.pi * 2.0 ** (each / BANDS_PER_OCTAVE)),
            )
            for which, *result in _regress(data[:, own], deviation, chirp):
                weights[own[which]], unknown[own[which]], residual[:, own[which]] = result
            if progress is not None:
                progress(done, len(bands))
    weights = weights.reshape(*spectra.shape[1:], count)
    unknown = np.reshape(unknown, spectra.shape[1:])
    residual = residual.reshape(spectra.shape)
    scatter = np.einsum("rsf,rtf->fst", residual, residual.conj())
    typical = np.median(np.einsum("fss->fs", scatter).real, axis=0) / freedom
    prior = sensors + 2
    scatter = (scatter + prior * np.diag(typical)) / (freedom + prior)
    values = np.einsum("sfr,rsf->sf", weights, spectra)
    covariance = scatter * np.einsum("sfr,tfr->fst", weights, weights.conj())
    for s in range(sensors):
        covariance[:, s, s] += unknown[s]
    return values, covariance


def mean_speed(speed_hz: np.ndarray) -> float:
    """Mean speed over the time that revolutions (R,) take, Hz."""
    return float(1 / np.mean(1 / speed_hz))


class _Kernel(NamedTuple):
    """The covariance of what B revolutions answer."""

    deviation: np.ndarray  # (B,)
    chirp: np.ndarray  # (B,)
    width: float
    factor: np.ndarray  # (B, r) of the whole covariance
    sizes: np.ndarray  # (r,) eigenvalues of the part that is free of the mean; others are zero
    basis: np.ndarray  # (B, r) their eigenvectors

    @property
    def covariance(self) -> np.ndarray:
        """The whole covariance (B, B)."""
        return self.factor @ self.factor.conj().T

    @property
    def to_mean(self) -> np.ndarray:
        """Covariance (B,) with the answer at the mean speed."""
        return response_covariance(self.deviation, self.chirp, 0.0, 0.0, self.width)


def _regress(data, deviation, chirp) -> Iterator[tuple]:
    """Columns of data (R, N) that depend on the speed: (which, weights, variance of the unknown,
    residual) of each group of them that takes one covariance.

    chirp (R,) is the rate of the relative deviation over twice the angular frequency.
    """
    count = len(deviation)
    blocks = _blocks(count)
    chosen, tried = _choose_covariances(data, deviation, chirp, blocks)
    for k in np.unique(chosen[chosen >= 0]):
        which = chosen == k
        ratio, kernels = tried[k]
        row = np.empty(count, complex)
        rest = np.empty((count, np.count_nonzero(which)), complex)
        noise, missed = 0.0, 0.0
        for own, kernel in zip(blocks, kernels(), strict=True):
            size, covariance, to_mean = len(own), kernel.covariance, kernel.to_mean
            system = np.ones((size + 1, size + 1), complex)
            system[:size, :size] = ratio * covariance + np.eye(size)
            system[size, size] = 0.0
            solved = np.linalg.solve(system, np.append(ratio * to_mean, 1.0))[:size]
            centred = data[np.ix_(own, which)]
            centred = centred - centred.mean(axis=0)
            part = kernel.basis.conj().T @ centred
            shrink = (1 / (1 + ratio * kernel.sizes))[:, None]
            noise += np.sum(np.abs(centred - kernel.basis @ part) ** 2, axis=0)
            noise += np.sum(shrink * np.abs(part) ** 2, axis=0)
            rest[own] = centred - kernel.basis @ ((1 - shrink) * part)
            # an error of the function is the same in every block
            error = 1 + np.vdot(solved, covariance @ solved - 2 * to_mean).real
            missed += size / count * max(error, 0.0)
            row[own] = size / count * solved
        noise = noise / (count - len(blocks)) * _variance_inflation(rest)
        # as large as the noise is, for some of it went into the function
        rest *= np.sqrt(noise * (count - 1) / (np.sum(np.abs(rest) ** 2, axis=0) + 1e-300))
        yield which, row.conj(), noise * ratio * missed, rest


def _blocks(count: int) -> list[np.ndarray]:
    """Indices of the revolutions that are regressed together: all, or every n-th of them."""
    number = 1 if count <= MAX_REVOLUTIONS_TOGETHER else -(-count // MAX_BLOCK_REVOLUTIONS)
    return [np.arange(first, count, number) for first in range(number)]


def _choose_covariances(data, deviation, chirp, blocks) -> tuple[np.ndarray, list]:
    """For each column of data (R, N) the most likely covariance: its index, -1 where none is worth
    MIN_GAIN, and for each index (ratio, a function that gives the kernels of the blocks)."""
    plain, totals = 0.0, []
    for own in blocks:
        totals.append(np.sum(np.abs(data[own] - data[own].mean(axis=0)) ** 2, axis=0))
        plain = plain + (len(own) - 1) * np.log(totals[-1] + 1e-300)
    best = -plain + MIN_GAIN
    chosen = np.full(data.shape[1], -1)
    tried: list[tuple[float, Callable]] = []
    for width in WIDTHS:
        likelihood = np.zeros((len(VARIANCE_RATIOS), data.shape[1]))
        kernels: Iterable[_Kernel] = (_kernel(deviation[own], chirp[own], width) for own in blocks)
        if len(blocks) == 1:  # kept; of many blocks they are calculated again where they are chosen
            kernels = list(kernels)
        for own, total, kernel in zip(blocks, totals, kernels, strict=True):
            power = np.abs(kernel.basis.conj().T @ data[own]) ** 2
            apart = np.maximum(total - np.sum(power, axis=0), 0.0)  # no part of the function
            for k, ratio in enumerate(VARIANCE_RATIOS):
                shrink = 1 / (1 + ratio * kernel.sizes)
                likelihood[k] += np.sum(np.log(shrink))
                likelihood[k] -= (len(own) - 1) * np.log(apart + shrink @ power + 1e-300)
        again = partial(_kernels, kernels, blocks, deviation, chirp, width)
        for k, ratio in enumerate(VARIANCE_RATIOS):
            chosen[likelihood[k] > best] = len(tried)
            best = np.maximum(best, likelihood[k])
            tried.append((ratio, again))
    return chosen, tried


def _kernels(kept, blocks, deviation, chirp, width) -> Iterator[_Kernel]:
    """The kernels of the blocks: those that were kept, else calculated again."""
    if isinstance(kept, list):
        return iter(kept)
    return (_kernel(deviation[own], chirp[own], width) for own in blocks)


def _kernel(deviation, chirp, width) -> _Kernel:
    """The covariance of what revolutions answer whose speeds deviate so and change so fast."""
    factor = factor_covariance(deviation, chirp, width)
    inner = _off_mean(factor)
    if factor.shape[1] < len(inner):
        sizes, turn = np.linalg.eigh(inner.conj().T @ inner)
        turn = inner @ turn
    else:
        sizes, turn = np.linalg.eigh(inner @ inner.conj().T)
    kept = sizes > MIN_SIZE
    basis = _reflect(np.vstack([np.zeros(np.count_nonzero(kept)), turn[:, kept]]))
    basis /= np.linalg.norm(basis, axis=0)
    return _Kernel(deviation, chirp, width, factor, sizes[kept], basis)


def _off_mean(data):
    """Coordinates (B - 1, N) of columns (B, N) in an orthonormal basis free of the mean."""
    return _reflect(data)[1:]


def _reflect(data):
    """Columns (B, N) reflected so that a constant column becomes the first axis (Householder)."""
    normal = np.full(len(data), 1 / np.sqrt(len(data)))
    normal[0] -= 1.0
    square = normal @ normal
    return data if square == 0.0 else data - np.outer(normal, 2 / square * (normal @ data))


def _variance_inflation(rest):
    """Factor (N,) on the variance of a mean of residuals (R, N) that are not independent.

    (1 + r)/(1 - r) for a significant correlation r of neighbours: they are alike where the function
    has missed something, and then more revolutions add less information.
    """
    r = np.sum(rest[1:] * rest[:-1].conj(), axis=0).real
    r = r / (np.sum(np.abs(rest) ** 2, axis=0) + 1e-300)
    least = MIN_CORRELATION / np.sqrt(2 * len(rest))
    r = np.where(r > least, np.minimum(r, MAX_CORRELATION), 0.0)
    return (1 + r) / (1 - r)
