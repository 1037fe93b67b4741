"""Harmonics at the mean speed, from revolutions whose speed wanders through resonances."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from rippletwin.spectra.speed_regression import harmonics_at_mean_speed, mean_speed

MEAN_HZ, FINE, COUNT = 25.0, 50, 80
POLE = -np.pi + 2j * np.pi * 140.02 * MEAN_HZ  # a resonance 1 Hz wide, quality 3500


def drift(count, size, seed):
    """Relative deviations (count,) of the speed: a slow swing and a little more."""
    t = np.arange(count) / count
    phase = np.random.default_rng(seed).uniform(0, 2 * np.pi, 2)
    deviation = np.sin(2 * np.pi * t + phase[0]) + 0.4 * np.sin(5 * np.pi * t + phase[1])
    return size * (deviation - deviation.mean())


def driven(order, size, seed):
    """Mean speed, revolutions' speeds (R,) and what a resonance answers in each (R,).

    The differential equation of the resonance, in time, its drive `order` times a shaft whose
    speed wanders: exact for each of FINE steps a revolution.
    """
    deviation = CubicSpline(np.arange(COUNT) + 0.5, drift(COUNT, size, seed))
    deviation = deviation(np.arange(COUNT * FINE) / FINE)
    step = 1 / (MEAN_HZ * (1 + deviation)) / FINE
    envelope, track = None, []
    for d, dt in zip(deviation, step, strict=True):
        rate = POLE - 2j * np.pi * order * MEAN_HZ * (1 + d)  # dy/dt = rate y + pi
        steady = -np.pi / rate
        envelope = steady if envelope is None else steady + (envelope - steady) * np.exp(rate * dt)
        track.append(envelope)
    speed = 1 / step.reshape(COUNT, FINE).sum(1)
    return mean_speed(speed), speed, np.reshape(track, (COUNT, FINE)).mean(1)


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
    0.1 % of speed. Against the analytic steady answer the value at the mean speed errs by less than
    a quarter of what the mean over the revolutions does, and by no more than it says."""
    mean, speed, answer = driven(order, 2e-4, seed)
    true = -np.pi / (POLE - 2j * np.pi * order * mean)
    values, covariance = harmonics_at_mean_speed(
        noisy(answer, 1e-4 * abs(true), seed), speed, np.full(40, order)
    )
    plain, found = abs(answer.mean() - true), abs(values.mean() - true)
    assert plain > 0.02 * abs(true)
    assert found < 0.25 * plain
    assert found < 4 * np.sqrt(np.median(covariance[:, 0, 0].real))


@pytest.mark.parametrize("seed", range(4))
def test_on_a_resonance_the_error_is_stated(seed):
    """The same on the resonance itself, whose memory is as long as the speed's swing: there the
    mean over the revolutions errs by a third to two thirds. What is left is stated."""
    mean, speed, answer = driven(140, 3e-4, seed)
    true = -np.pi / (POLE - 2j * np.pi * 140 * mean)
    values, covariance = harmonics_at_mean_speed(
        noisy(answer, 1e-3 * abs(true), seed), speed, np.full(40, 140)
    )
    error = np.abs(values[0] - true)
    assert np.all(error < 0.6 * abs(answer.mean() - true))
    assert np.all(error < 4 * np.sqrt(covariance[:, 0, 0].real))


@pytest.mark.parametrize("size", [0.0, 1e-6, 1e-3])
def test_where_speed_does_nothing_nothing_is_paid(size):
    """Statistics: noise alone, whatever the speed does. The covariance is that of the mean of the
    revolutions, to 10 %, and errors are as large as it says."""
    rng = np.random.default_rng(3)
    speed = MEAN_HZ * (1 + drift(60, size, 3))
    noise = rng.standard_normal((60, 2, 160)) + 1j * rng.standard_normal((60, 2, 160))
    values, covariance = harmonics_at_mean_speed(5.0 + noise, speed, np.arange(1, 161))
    variance = np.einsum("fss->sf", covariance).real
    assert np.mean(variance) == pytest.approx(2 / 60, rel=0.1)
    assert np.mean(np.abs(values - 5.0) ** 2 / variance) == pytest.approx(1.0, abs=0.2)


def test_few_revolutions_are_averaged():
    """By definition: below eight revolutions the value is their mean."""
    rng = np.random.default_rng(4)
    spectra = rng.standard_normal((5, 2, 3)) + 1j
    values, covariance = harmonics_at_mean_speed(spectra, MEAN_HZ * np.ones(5), np.arange(1, 4))
    np.testing.assert_allclose(values, spectra.mean(0), rtol=1e-12)
    assert np.all(np.linalg.eigvalsh(covariance) > 0)
