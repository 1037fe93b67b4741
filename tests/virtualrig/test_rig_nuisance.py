"""Nuisance physics of a population: temperature gradient, and what a sensor adds."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.signal import welch

from virtualrig.draw import truth_of_segments
from virtualrig.instrument import Instrument, coloured_noise, measure, revolution_scatter
from virtualrig.network import Network, Node, Pipe, discretise
from virtualrig.nuisance import cut_with_gradient, segments_as_recorded
from virtualrig.recorder import SAMPLING_RATE_HZ

SEGMENTS = [
    {"length": 2.1, "diameter": 0.016, "wave_speed": 1200.0},
    {"length": 3.3, "diameter": 0.014, "wave_speed": 1050.0},
]


def test_waves_take_as_long_as_the_temperature_makes_them():
    """Travel time over a line with a gradient is the integral of dx/a(x), to 1e-5 of it, in the rig
    and in the truth that verdicts are scored by; and the pieces meet at sensors and joints."""
    drop, kelvin = 6.0, 1.5
    pieces = cut_with_gradient(SEGMENTS, [0.5, 3.0], 4e-5, drop, kelvin)
    time = sum(piece["length"] / piece["wave_speed"] for piece in pieces)
    ends = [0.0, 2.1, 5.4]

    def slowness(x, nominal):
        return 1 / (nominal * (1 - 0.003 * (kelvin + drop * (0.5 - x / ends[-1]))))

    exact = sum(
        quad(slowness, a, b, args=(s["wave_speed"],))[0]
        for s, a, b in zip(SEGMENTS, ends[:-1], ends[1:], strict=True)
    )
    assert time == pytest.approx(exact, rel=1e-5)
    assert exact != pytest.approx(2.1 / 1200 + 3.3 / 1050, rel=1e-3)
    truth = truth_of_segments(segments_as_recorded(SEGMENTS, drop, kelvin), 870.0)
    assert sum(segment["delay"] for segment in truth) == pytest.approx(exact, rel=1e-5)
    joints = np.cumsum([piece["length"] for piece in pieces])
    for place in (0.5, 2.1, 3.0, 5.4):
        assert np.abs(joints - place).min() < 1e-9
    viscosity = [piece["viscosity"] for piece in pieces]
    assert np.all(np.diff(viscosity) > 0)  # colder towards the load
    assert np.exp(-0.04 * kelvin) * 4e-5 == pytest.approx(np.median(viscosity), rel=0.05)


def test_a_pipe_has_its_own_viscosity():
    """A pipe with a viscosity of its own is that of a network filled with such a liquid."""

    def line(own, of_network):
        pipe = Pipe(1.0, 0.016, 1200.0, 0, 1, viscosity=own)
        network = Network((pipe,), (Node(), Node()), (), 870.0, of_network)
        return discretise(network, 1e-6)

    assert np.array_equal(line(8e-5, 3e-5).gains, line(None, 8e-5).gains)
    assert not np.array_equal(line(None, 3e-5).gains, line(None, 8e-5).gains)


def test_noise_has_the_colour_that_is_asked_for():
    """Its rms is right, and its density is 1 + corner/f: sixfold at a fifth of the corner against
    far above it, by Welch's method to 10 %."""
    noise = coloured_noise(2, 2**18, 1500.0, 1000.0, np.random.default_rng(0))
    assert noise.std(axis=1) == pytest.approx(1500.0, rel=0.02)
    assert abs(np.corrcoef(noise)[0, 1]) < 0.1
    frequency, density = welch(noise, SAMPLING_RATE_HZ, nperseg=4096)
    for low, high in ((150, 250), (900, 1100), (15000, 20000)):
        band = (frequency > low) & (frequency < high)
        expected = np.mean(1 + 1000.0 / frequency[band])
        far = (frequency > 10000) & (frequency < 20000)
        reference = np.mean(1 + 1000.0 / frequency[far])
        ratio = density[:, band].mean() / density[:, far].mean()
        assert ratio == pytest.approx(expected / reference, rel=0.1)


def test_revolutions_scatter_and_sensors_drift():
    """The ripple of whole revolutions scatters by what is asked for; the mean is offset and moves
    by the drift; a perfect instrument changes nothing."""
    turns = np.arange(2000 * 32 + 1) / 32
    factor = revolution_scatter(turns, 0.01, np.random.default_rng(1))
    assert factor[::32].std() == pytest.approx(0.01, rel=0.05)
    ripple = 5e6 + 1e5 * np.sin(2 * np.pi * 9 * turns)[None]
    perfect = Instrument(0.0, 100.0, 0.0, (0.0,), 0.0)
    rng = np.random.default_rng(2)
    assert measure(ripple, turns, perfect, rng) == pytest.approx(ripple, rel=1e-12)
    drifting = Instrument(0.0, 100.0, 0.0, (3e4,), 1e3)
    slopes = []
    for _ in range(200):
        added = measure(ripple, turns, drifting, rng) - ripple
        assert added.mean() == pytest.approx(3e4, abs=1.0)
        slopes.append(added[0, -1] - added[0, 0])
    assert np.std(slopes) == pytest.approx(1e3, rel=0.15)
