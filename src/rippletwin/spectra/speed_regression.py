"""Harmonics at the mean speed from revolutions whose speed wanders.

A line answers differently at another speed: a path of 5 m of oil turns the phase at 5 kHz by half a
radian for 0.3 %, and a resonance can be narrower than the speed wanders, so that the mean over the
revolutions is that of no speed at all. Each order of each sensor is therefore taken for a smooth
function of the speed, and its value at the mean speed is what the revolutions say of it by Gaussian
process regression (Rasmussen & Williams 2006, Gaussian Processes for Machine Learning, sec. 2.2
and 2.7), with the width and the size of what the speed does chosen for each by the restricted
likelihood (Patterson & Thompson 1971, Biometrika 58, 545).

A resonance remembers the speed it had: on the way up it answers otherwise than on the way down.
Where the angular frequency w rises at the rate r, a system of response H answers
exp(-j r/2 d^2/dw^2) H(w) (expand H about w under the integral over a linear chirp; its first term
is in Carson & Fry 1937, Bell Syst. Tech. J. 16, 513). That operator turns a Gaussian covariance of
H into another Gaussian of complex width, in closed form, and so the memory is part of the model.
"""

from __future__ import annotations

import numpy as np

ENOUGH = 8  # revolutions: below it the mean is taken
WIDTHS = 1e-4 * 2.0 ** np.arange(9)  # relative speed over which an order may change
RATIOS = 10.0 ** np.arange(-1, 8)  # variance of what the speed does over that of the noise
BANDS = 3  # an octave, in which the memory is one
GAIN = 5.0  # log likelihood that an order's dependence on the speed must be worth


def harmonics_at_mean_speed(
    spectra: np.ndarray, speed_hz: np.ndarray, orders: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Values (S, F) at the mean speed of spectra (R, S, F), and their covariance (F, S, S).

    speed_hz (R,) of the revolutions, which follow each other; orders (F,) from 1. The covariance is
    that of the scatter about the function of speed and of what is not known of the function;
    `S + 2` revolutions' worth of the sensor's typical noise is mixed into the scatter, which keeps
    it positive definite where there are few revolutions.
    """
    count, sensors, _ = spectra.shape
    data = spectra.reshape(count, -1)
    weights = np.full((data.shape[1], count), 1 / count, dtype=complex)
    unknown = np.zeros(data.shape[1])
    residual = data - data.mean(axis=0)
    freedom = max(count - 1, 1)
    if count >= ENOUGH:
        mean = mean_speed(speed_hz)
        deviation = speed_hz / mean - 1
        rate = np.gradient(deviation, np.cumsum(1 / speed_hz))
        band = np.tile(np.round(BANDS * np.log2(orders * mean)).astype(int), sensors)
        for each in np.unique(band):
            own, chirp = np.flatnonzero(band == each), rate / (4 * np.pi * 2.0 ** (each / BANDS))
            for which, *found in _regress(data[:, own], deviation, chirp):
                weights[own[which]], unknown[own[which]], residual[:, own[which]] = found
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
    """Columns of data (R, N) that depend on the speed: (which, weights, variance of the unknown,
    residual) of each group of them that takes one covariance.

    chirp (R,) is the rate of the relative deviation over twice the angular frequency.
    """
    count = len(deviation)
    contrasts = np.linalg.svd(np.ones((1, count)))[2][1:].T  # (R, R - 1), free of the mean
    plain = (count - 1) * np.log(np.sum(np.abs(contrasts.T @ data) ** 2, axis=0) + 1e-300)
    best = -plain + GAIN
    chosen = np.full(data.shape[1], -1)
    tried = []
    for width in WIDTHS:
        to_mean = _covariance(deviation, chirp, width)
        apart = deviation[:, None] - deviation, chirp[:, None] - chirp
        kernel = _covariance(*apart, width)
        size, basis = np.linalg.eigh(contrasts.T @ kernel @ contrasts)
        size, basis = np.maximum(size, 0.0), contrasts @ basis
        power = np.abs(basis.conj().T @ data) ** 2
        for ratio in RATIOS:
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
        noise *= _dependence(rest)
        # as large as the noise is, for some of it went into the function
        rest *= np.sqrt(noise * (count - 1) / (np.sum(np.abs(rest) ** 2, axis=0) + 1e-300))
        missed = 1 + np.vdot(row, kernel @ row - 2 * to_mean).real
        yield which, row.conj(), noise * ratio * max(missed, 0.0), rest


def _dependence(rest):
    """How many times the variance of a mean is what independent rests (R, N) would give, (N,).

    Where neighbours are alike the function has missed something, and many revolutions say it again:
    (1 + r)/(1 - r) for the correlation r of neighbours, where that is more than chance.
    """
    r = np.sum(rest[1:] * rest[:-1].conj(), axis=0).real
    r = r / (np.sum(np.abs(rest) ** 2, axis=0) + 1e-300)
    r = np.where(r > 3 / np.sqrt(2 * len(rest)), np.minimum(r, 0.98), 0.0)
    return (1 + r) / (1 - r)


def _covariance(deviation, chirp, width):
    """Of what is answered at two speeds `deviation` apart while they change by `chirp` more."""
    square = width**2 - 2j * chirp
    return width / np.sqrt(square) * np.exp(-0.5 * deviation**2 / square)
