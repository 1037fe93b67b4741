"""A passive end by its Schur parameters, against ends that are known in closed form."""

import numpy as np
import pytest

from rippletwin.line.frequency_domain.passive_end import end_impedance, reflection_coefficient

RATE = 2 * np.pi * 500.0
S = 2j * np.pi * np.linspace(5.0, 5000.0, 300)


def test_no_parameters_are_active():
    """|R| <= 1 in the right half-plane, and Re Z >= 0 on the axis, for parameters drawn up to the
    bound: the definition of passive."""
    rng = np.random.default_rng(1)
    w = 2 * np.pi * np.geomspace(1.0, 1e5, 60)
    plane = np.concatenate([w * np.exp(1j * angle) for angle in np.linspace(-1.57, 1.57, 9)])
    for schur in np.tanh(2.0 * rng.normal(size=(200, 9))):
        assert np.all(np.abs(reflection_coefficient(plane, schur, RATE)) <= 1.0 + 1e-9)
        impedance = end_impedance(reflection_coefficient(S, schur, RATE), 3.0)
        assert np.all(impedance.real >= -1e-9 * np.abs(impedance))


@pytest.mark.parametrize("first, reflected", [(1.0, 1.0), (-1.0, -1.0), (0.0, 0.0)])
def test_closed_open_and_anechoic_ends(first, reflected):
    """Closed R = 1, open R = -1, anechoic R = 0."""
    schur = [first, *([0.0] * 8)]
    np.testing.assert_allclose(reflection_coefficient(S, schur, RATE), reflected, atol=1e-12)


def test_a_resistance_beside_a_volume_behind_a_resistance():
    """Z/Zc = 1/2 + 2/(1 + s tau) as its parameters by Schur's algorithm, from a power series that
    is sampled on the unit circle: nine parameters follow it to 1 %, thirty to 1e-6."""
    tau = 0.6 / RATE

    def exact(s):
        z = 0.5 + 2.0 / (1.0 + s * tau)
        return (z - 1.0) / (z + 1.0)

    ring = np.exp(2j * np.pi * (np.arange(512) + 0.5) / 512)  # beside infinite s
    samples = exact(RATE * (1.0 - ring) / (1.0 + ring))
    series = (np.fft.fft(samples) / 512 * np.exp(-1j * np.pi * np.arange(512) / 512)).real
    for count, error in ((9, 1e-2), (30, 1e-6)):
        schur = schur_parameters(series[:256], count)
        followed = reflection_coefficient(S, schur, RATE)
        np.testing.assert_allclose(followed, exact(S), atol=error)


def schur_parameters(series, count):
    """Schur's algorithm on a power series: the inverse of the recursion under test."""
    up, down = np.array(series), np.zeros_like(series)
    down[0] = 1.0
    found = []
    for _ in range(count):
        g = up[0] / down[0]
        found.append(g)
        up, down = np.append((up - g * down)[1:], 0.0), down - g * up
    return np.array(found)
