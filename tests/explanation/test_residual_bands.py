"""Frequency bands and shaft angles of residuals that were made to lie there."""

from types import SimpleNamespace

import numpy as np
import pytest

from rippletwin.explanation.localise import residual_bands


@pytest.mark.parametrize("low, high", [(900.0, 1500.0), (2200.0, 3900.0), (150.0, 700.0)])
def test_a_noisy_band_gives_one_interval(low, high):
    """Noisy excess in one band at the harmonics of three speeds gives one interval, with its ends
    within two harmonics of the true ones; single harmonics would give a dozen."""
    rng = np.random.default_rng(1)
    frequency = np.concatenate([f * np.arange(1, int(4000 / f) + 1) for f in (150.0, 180.0, 225.0)])
    size = rng.exponential(1.0, len(frequency))
    inside = (frequency >= low) & (frequency <= high)
    size[inside] = 200.0 * rng.exponential(1.0, inside.sum())
    (found,) = residual_bands.find_frequency_bands(frequency, size, 225.0)
    assert abs(found[0] - low) < 450 and abs(found[1] - high) < 450


def test_two_distant_bands_stay_apart():
    """Excess in two distant bands is not joined across the gap."""
    frequency = 150.0 * np.arange(1, 27)
    size = np.ones(26)
    size[1:4] = 100.0
    size[19:24] = 100.0
    found = residual_bands.find_frequency_bands(frequency, size, 150.0)
    assert len(found) == 2
    assert found[0][1] < 1000 < 2500 < found[1][0]


def test_scattered_excess_gives_few_bands_with_most_of_it():
    """If every second harmonic is in excess, at most four bands hold 85 % of it."""
    frequency = 150.0 * np.arange(1, 27)
    size = np.where(np.arange(26) % 2, 100.0, 1.0)
    found = residual_bands.find_frequency_bands(frequency, size, 150.0)
    assert len(found) <= residual_bands.MAX_INTERVALS
    inside = np.any([(frequency >= a) & (frequency <= b) for a, b in found], axis=0)
    assert np.sum(size[inside] - 1) > 0.85 * np.sum(size - 1)


def test_a_residual_of_the_expected_size_has_no_band():
    """A mean square below 1 everywhere gives no band."""
    assert residual_bands.find_frequency_bands(np.arange(1.0, 20.0), np.full(19, 0.5), 1.0) == []


def test_one_frequency_is_a_band_of_no_width():
    """Residuals at one frequency alone, at one operating point or at two."""
    for count in (1, 2):
        found = residual_bands.find_frequency_bands(np.full(count, 150.0), np.full(count, 9.0), 1.0)
        assert found == [[150.0, 150.0]]


def test_operating_points_of_one_frequency_each_have_bands(monkeypatch):
    """In a narrow band each recording may have one harmonic, which has no neighbour: the band is at
    the one that is in excess."""
    points = [SimpleNamespace(frequency_hz=np.array([f])) for f in (150.0, 180.0, 225.0)]
    whitened = SimpleNamespace(observations=points), np.array([[1.0, 9.0, 1.0]])
    monkeypatch.setattr(residual_bands, "_whitened_residual", lambda *_: whitened)
    ((low, high),) = residual_bands.residual_frequency_bands(None, points)
    assert 160.0 < low < 180.0 < high < 205.0


def burst(at_deg, width_deg, pitch_deg=40.0, harmonics=26, samples=360):
    """One-sided wave over a pitch of a Gaussian burst at an angle, from its harmonics."""
    k = np.arange(1, harmonics + 1)
    spectrum = np.exp(-0.5 * (2 * np.pi * k * width_deg / pitch_deg) ** 2)
    spectrum = spectrum * np.exp(-2j * np.pi * k * at_deg / pitch_deg)
    return spectrum @ np.exp(2j * np.pi * np.outer(k, np.arange(samples) / samples))


@pytest.mark.parametrize("at", [5.0, 25.0, 33.0])
def test_a_burst_is_found_at_its_angle(at):
    """A burst of 1 degree gives one interval that contains its angle and is at most a quarter of
    the pitch long, though the wave changes sign many times."""
    rng = np.random.default_rng(2)
    noise = rng.normal(size=(2, 360)) * 0.05
    (found,) = residual_bands.find_angle_intervals(burst(at, 1.0) + noise[0] + 1j * noise[1], 40.0)
    assert found[0] < at < found[1]
    assert found[1] - found[0] < 10.0


def test_a_burst_at_angle_0_gives_two_parts_of_one_interval():
    """The interval around angle 0 is returned as its two parts, together as short."""
    first, last = residual_bands.find_angle_intervals(burst(0.0, 1.0), 40.0)
    assert first[0] == 0.0 and last[1] == 40.0
    assert first[1] + 40.0 - last[0] < 10.0


@pytest.mark.parametrize("source", ["nominal", "free"])
def test_a_free_source_has_no_shaft_angle(monkeypatch, source):
    """The same residual, a burst, of a source whose shaft angle is fitted and of a free one."""
    orders = 9 * np.arange(1, 27)
    values = np.exp(-0.5 * (2 * np.pi * np.arange(1, 27) / 40.0) ** 2)[None] + 0j
    observation = SimpleNamespace(label="a", orders=orders, source=source, values=values)
    posterior = SimpleNamespace(
        observations=[observation],
        forward=SimpleNamespace(slices=[slice(None)]),
        predict=np.zeros_like,
    )
    monkeypatch.setattr(residual_bands, "_posterior", lambda *_: posterior)
    fit = SimpleNamespace(twin=SimpleNamespace(theta=values, index={}))
    found = residual_bands.residual_crank_angles(fit, [observation])
    assert bool(found) == (source == "nominal")


def test_a_single_harmonic_has_no_angle():
    """A residual of one harmonic has the same envelope at all angles, hence no interval."""
    wave = np.exp(2j * np.pi * 5 * np.arange(360) / 360)
    assert residual_bands.find_angle_intervals(wave, 40.0) == []
