"""Similarity of time-frequency images on cases with a known result."""

import numpy as np
import pytest

from rippletwin.learning.synchrosqueezing import image_similarity

RNG = np.random.default_rng(0)
IMAGE = RNG.random((2, 12, 16))


def test_turned_and_scaled_is_the_same_image():
    """Exact: a cyclic shift in time costs nothing, a factor shows in the amplitude alone."""
    similarity, amplitude = image_similarity(IMAGE, 0.3 * np.roll(IMAGE, 5, -1))
    assert similarity == pytest.approx(1) and amplitude == pytest.approx(0.3)


def test_ridges_at_other_frequencies_have_nothing_in_common():
    """Exact: energy in different rows never meets, at any shift."""
    low, high = np.zeros((2, 1, 4, 8))
    low[0, 1], high[0, 2] = 1, 1
    assert image_similarity(low, high)[0] == 0


def test_largest_over_shifts():
    """Against the definition, shift by shift."""
    other = RNG.random((2, 12, 16))
    direct = max(
        (IMAGE * np.roll(other, k, -1)).sum() / np.linalg.norm(IMAGE) / np.linalg.norm(other)
        for k in range(16)
    )
    assert image_similarity(IMAGE, other)[0] == pytest.approx(direct)


def test_channels_turn_together():
    """Channels that would need different shifts to match are not alike."""
    first, second = np.zeros((2, 2, 1, 8))
    first[:, 0, 0] = 1
    second[0, 0, 1] = second[1, 0, 3] = 1
    assert image_similarity(first, second)[0] == pytest.approx(0.5)


def test_silence_is_refused():
    with pytest.raises(ValueError, match="without energy"):
        image_similarity(IMAGE, np.zeros_like(IMAGE))
