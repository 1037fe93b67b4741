"""Harmonics at the mean speed, from revolutions whose speed varies across resonances."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from rippletwin.spectra.response_covariance import factor_covariance
from rippletwin.spectra.speed_regression import _kernel, mean_speed, regress_to_mean_speed

MEAN_HZ, STEPS_PER_REVOLUTION, COUNT = 25.0, 50, 80
POLE = -np.pi + 2j * np.pi * 140.02 * MEAN_HZ  # a resonance 1 Hz wide, quality 3500


def drift(count, size, seed):
    """Relative deviations (count,) of the speed: a slow oscillation and a faster one."""
    t = np.arange(count) / count
    phase = np.random.default_rng(seed).uniform(0, 2 * np.pi, 2)
    deviation = np.sin(2 * np.pi * t + phase[0]) + 0.4 * np.sin(5 * np.pi * t + phase[1])
    return size * (deviation - deviation.mean())


def driven(order, size, seed):
    """Mean speed, revolutions' speeds (R,) and a resonance's response in each (R,).

    The differential equation of the resonance, in time, its drive `order` times a shaft whose
    speed varies: exact for each of STEPS_PER_REVOLUTION steps a revolution.
    """
    deviation = CubicSpline(np.arange(COUNT) + 0.5, drift(COUNT, size, seed))
    deviation = deviation(np.arange(COUNT * STEPS_PER_REVOLUTION) / STEPS_PER_REVOLUTION)
    step = 1 / (MEAN_HZ * (1 + deviation)) / STEPS_PER_REVOLUTION
    envelope, track = None, []
    for d, dt in zip(deviation, step, strict=True):
        rate = POLE - 2j * np.pi * order * MEAN_HZ * (1 + d)  # dy/dt = rate y + pi
        steady = -np.pi / rate
        envelope = steady if envelope is None else steady + (envelope - steady) * np.exp(rate * dt)
        track.append(envelope)
    speed = 1 / step.reshape(COUNT, STEPS_PER_REVOLUTION).sum(1)
    return mean_speed(speed), speed, np.reshape(track, (COUNT, STEPS_PER_REVOLUTION)).mean(1)


def noisy(values, size, seed):
    """Spectra (R, 1, 40): 40 times the same values (R,) with as many draws of noise."""
    rng = np.random.default_rng(seed)
    shape = (len(values), 1, 40)
    noise = rng.standard_normal(shape) + 1j * rng.standard_normal(shape)
    return values[:, None, None] + size * noise


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("order", [139.9, 140.12])
def test_the_side_of_a_resonance_is_read_at_the_mean_speed(order, seed):
    """Another method: the resonance's differential equation, 0.3 s of memory, swept on its slope by
    0.1 % of speed. Against the analytic steady response the value at the mean speed errs by less
    than a quarter of the error of the mean over the revolutions, and within its covariance."""
    mean, speed, response = driven(order, 2e-4, seed)
    true = -np.pi / (POLE - 2j * np.pi * order * mean)
    values, covariance = regress_to_mean_speed(
        noisy(response, 1e-4 * abs(true), seed), speed, np.full(40, order)
    )
    plain, found = abs(response.mean() - true), abs(values.mean() - true)
    assert plain > 0.02 * abs(true)
    assert found < 0.25 * plain
    assert found < 4 * np.sqrt(np.median(covariance[:, 0, 0].real))


@pytest.mark.parametrize("seed", range(4))
def test_on_a_resonance_the_error_is_stated(seed):
    """The same on the resonance itself, which decays as slowly as the speed varies: there the mean
    over the revolutions errs by a third to two thirds. The rest is in the covariance."""
    mean, speed, response = driven(140, 3e-4, seed)
    true = -np.pi / (POLE - 2j * np.pi * 140 * mean)
    values, covariance = regress_to_mean_speed(
        noisy(response, 1e-3 * abs(true), seed), speed, np.full(40, 140)
    )
    error = np.abs(values[0] - true)
    assert np.all(error < 0.6 * abs(response.mean() - true))
    assert np.all(error < 4 * np.sqrt(covariance[:, 0, 0].real))


@pytest.mark.parametrize("size", [0.0, 1e-6, 1e-3])
def test_independence_of_the_speed_costs_no_variance(size):
    """Statistics: noise alone, however the speed varies. The covariance is that of the mean of the
    revolutions, to 10 %, and that of the errors."""
    rng = np.random.default_rng(3)
    speed = MEAN_HZ * (1 + drift(60, size, 3))
    noise = rng.standard_normal((60, 2, 160)) + 1j * rng.standard_normal((60, 2, 160))
    values, covariance = regress_to_mean_speed(5.0 + noise, speed, np.arange(1, 161))
    variance = np.einsum("fss->sf", covariance).real
    assert np.mean(variance) == pytest.approx(2 / 60, rel=0.1)
    assert np.mean(np.abs(values - 5.0) ** 2 / variance) == pytest.approx(1.0, abs=0.2)


@pytest.mark.parametrize("width,low_rank", [(1e-5, False), (1e-3, True)])
def test_factor_and_eigenvectors_are_those_of_the_dense_covariance(width, low_rank):
    """Of speeds far apart and of speeds that lie together, where the factor has few columns: the
    covariance of the module's equation, and its part that is free of the mean."""
    rng = np.random.default_rng(5)
    deviation, chirp = rng.normal(scale=5e-4, size=40), rng.normal(scale=1e-8, size=40)
    square = width**2 - 2j * (chirp[:, None] - chirp)
    away = deviation[:, None] - deviation
    dense = width / np.sqrt(square) * np.exp(-0.5 * away**2 / square)
    factor = factor_covariance(deviation, chirp, width)
    assert (factor.shape[1] < 20) == low_rank
    np.testing.assert_allclose(factor @ factor.conj().T, dense, atol=1e-12)
    kernel = _kernel(deviation, chirp, width)
    free = dense - dense.mean(axis=0)
    free = free - free.mean(axis=1, keepdims=True)
    np.testing.assert_allclose(
        (kernel.basis * kernel.sizes) @ kernel.basis.conj().T, free, atol=1e-10
    )
    np.testing.assert_allclose(
        kernel.to_mean, width / np.sqrt(width**2 - 2j * chirp)
        * np.exp(-0.5 * deviation**2 / (width**2 - 2j * chirp)), rtol=1e-12,
    )  # fmt: skip


def test_few_revolutions_are_averaged():
    """By definition: below eight revolutions the value is their mean."""
    rng = np.random.default_rng(4)
    spectra = rng.standard_normal((5, 2, 3)) + 1j
    values, covariance = regress_to_mean_speed(spectra, MEAN_HZ * np.ones(5), np.arange(1, 4))
    np.testing.assert_allclose(values, spectra.mean(0), rtol=1e-12)
    assert np.all(np.linalg.eigvalsh(covariance) > 0)
