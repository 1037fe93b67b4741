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
"""

from __future__ import annotations

import numpy as np

MIN_REVOLUTIONS = 8  # for the regression; of fewer the mean is taken
WIDTHS = 1e-4 * 2.0 ** np.arange(9)  # candidates: relative speed over which an order changes
VARIANCE_RATIOS = 10.0 ** np.arange(-1, 8)  # candidates: variance of the function over the noise's
BANDS_PER_OCTAVE = 3  # in each of which one rate of change of the frequency is used
MIN_GAIN = 5.0  # of log likelihood, for an order to depend on the speed
MIN_CORRELATION = 3.0  # of neighbouring residuals, in standard errors, to be believed
MAX_CORRELATION = 0.98  # beyond which the noise of a mean is not increased


def harmonics_at_mean_speed(
    spectra: np.ndarray, speed_hz: np.ndarray, orders: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Values (S, F) at the mean speed of spectra (R, S, F), and their covariance (F, S, S).

    speed_hz (R,) of the revolutions, which follow each other; orders (F,) from 1. The covariance is
    that of the scatter about the function of speed plus that of the function itself. The scatter is
    averaged with the sensors' typical noise, weighted as S + 2 revolutions, which keeps it positive
    definite where there are few revolutions.
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
        for each in np.unique(band):
            own = np.flatnonzero(band == each)
            chirp = rate / (4 * np.pi * 2.0 ** (each / BANDS_PER_OCTAVE))
            for which, *result in _regress(data[:, own], deviation, chirp):
                weights[own[which]], unknown[own[which]], residual[:, own[which]] = result
    weights = weights.reshape(*spectra.shape[1:], count)
    unknown = unknown.reshape(spectra.shape[1:])
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


def _regress(data, deviation, chirp):
    """Regress the columns of data (R, N) that depend on the speed.

    Yields (which columns, their weights, variance of the estimate, residuals) for each group of
    columns with one covariance. chirp (R,) is the rate of the relative deviation over twice the
    angular frequency.
    """
    count = len(deviation)
    contrasts = np.linalg.svd(np.ones((1, count)))[2][1:].T  # (R, R - 1), free of the mean
    plain = (count - 1) * np.log(np.sum(np.abs(contrasts.T @ data) ** 2, axis=0) + 1e-300)
    best = -plain + MIN_GAIN
    chosen = np.full(data.shape[1], -1)
    tried = []
    for width in WIDTHS:
        to_mean = _covariance(deviation, chirp, width)
        kernel = _covariance(deviation[:, None] - deviation, chirp[:, None] - chirp, width)
        size, basis = np.linalg.eigh(contrasts.T @ kernel @ contrasts)
        size, basis = np.maximum(size, 0.0), contrasts @ basis
        power = np.abs(basis.conj().T @ data) ** 2
        for ratio in VARIANCE_RATIOS:
            shrink = 1 / (1 + ratio * size)
            likelihood = np.sum(np.log(shrink)) - (count - 1) * np.log(shrink @ power + 1e-300)
            chosen[likelihood > best] = len(tried)
            best = np.maximum(best, likelihood)
            tried.append((kernel, to_mean, size, basis, ratio))
    for k in np.unique(chosen[chosen >= 0]):
        kernel, to_mean, size, basis, ratio = tried[k]
        which = chosen == k
        system = np.ones((count + 1, count + 1), complex)
        system[:count, :count] = ratio * kernel + np.eye(count)
        system[count, count] = 0.0
        row = np.linalg.solve(system, np.append(ratio * to_mean, 1.0))[:count]
        part = basis.conj().T @ data[:, which]
        shrink = (1 / (1 + ratio * size))[:, None]
        noise = np.sum(shrink * np.abs(part) ** 2, axis=0) / (count - 1)
        rest = basis @ (shrink * part)
        noise *= _variance_inflation(rest)
        # The residuals are scaled to the noise: the function has absorbed a part of it.
        rest *= np.sqrt(noise * (count - 1) / (np.sum(np.abs(rest) ** 2, axis=0) + 1e-300))
        uncertainty = 1 + np.vdot(row, kernel @ row - 2 * to_mean).real
        yield which, row.conj(), noise * ratio * max(uncertainty, 0.0), rest


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


def _covariance(deviation, chirp, width):
    """Covariance of the responses at two speeds that differ by `deviation`, and their rates of
    change by `chirp`."""
    square = width**2 - 2j * chirp
    return width / np.sqrt(square) * np.exp(-0.5 * deviation**2 / square)
