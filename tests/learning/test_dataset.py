"""Augmentation and the split by time."""

from __future__ import annotations

import numpy as np
import pytest

from rippletwin.learning.dataset import augment, each_once, remove_mean, split_by_time


@pytest.fixture
def seed():
    rng = np.random.default_rng(1)
    return rng.standard_normal((4, 2, 96)) + np.arange(8).reshape(4, 2, 1)


def test_without_noise_a_sample_is_a_shifted_seed(seed):
    """Undoing the shift (found by circular correlation) gives the class's seed less its mean."""
    x, y = augment(seed, 5, np.zeros(2), np.random.default_rng(0))
    assert x.shape == (20, 2, 96) and x.dtype == np.float32
    assert (y == np.repeat(range(4), 5)).all()
    clean = remove_mean(seed)
    for sample, label in zip(x, y):
        match = [np.abs(np.roll(sample, s, -1) - clean[label]).max() for s in range(96)]
        assert min(match) < 1e-5


def test_channels_shift_together(seed):
    """Both sensors see the same crank angle: the shift that fits one channel fits the other."""
    x, y = augment(seed, 8, np.zeros(2), np.random.default_rng(3))
    clean = remove_mean(seed)
    for sample, label in zip(x, y):
        best = [
            np.argmin([np.abs(np.roll(sample[c], s) - clean[label, c]).max() for s in range(96)])
            for c in range(2)
        ]
        assert best[0] == best[1]


def test_shifts_cover_the_revolution_evenly(seed):
    """Against the uniform law: the mean of exp(j shift angle) of n samples is below 4/sqrt(n)."""
    impulse = np.zeros((1, 1, 64))
    impulse[0, 0, 0] = 1
    x, _ = augment(impulse, 2000, np.zeros(1), np.random.default_rng(0))
    angle = 2 * np.pi * x[:, 0].argmax(-1) / 64
    assert abs(np.exp(1j * angle).mean()) < 4 / np.sqrt(2000)


def test_noise_is_the_stated_fraction_of_each_sensor(seed):
    """Against its definition: what is left after the silent twin of the same draw has the standard
    deviation 0.15 times the sensor's, channel by channel, and is white."""
    std = np.array([2.0, 10.0])
    flat = np.zeros((4, 2, 1024))
    x, _ = augment(flat, 100, std, np.random.default_rng(0))
    np.testing.assert_allclose(x.std(axis=(0, 2)), 0.15 * std, rtol=0.01)
    np.testing.assert_allclose((x[..., 1:] * x[..., :-1]).mean() / (x**2).mean(), 0, atol=0.01)


def test_two_revolutions_repeat_the_signal_but_not_the_noise(seed):
    """Without noise the halves are equal; with noise they differ by sqrt(2) of its deviation."""
    x, _ = augment(seed, 3, np.zeros(2), np.random.default_rng(0), revolutions=2)
    assert x.shape == (12, 2, 192)
    np.testing.assert_allclose(x[..., :96], x[..., 96:], atol=1e-6)
    x, _ = augment(seed, 200, np.ones(2), np.random.default_rng(0), revolutions=2)
    difference = (x[..., :96] - x[..., 96:]).std()
    np.testing.assert_allclose(difference, 0.15 * np.sqrt(2), rtol=0.02)


def test_amplitude_survives(seed):
    """Mean removal only: a seed of half the amplitude gives samples of half the amplitude."""
    x, _ = augment(seed, 2, np.zeros(2), np.random.default_rng(5))
    half, _ = augment(seed / 2, 2, np.zeros(2), np.random.default_rng(5))
    np.testing.assert_allclose(half, x / 2, atol=1e-6)
    np.testing.assert_allclose(x.mean(-1), 0, atol=1e-5)


def test_same_generator_same_samples(seed):
    """Reproducible from the generator, and different from another one."""
    a, _ = augment(seed, 4, np.ones(2), np.random.default_rng(7))
    b, _ = augment(seed, 4, np.ones(2), np.random.default_rng(7))
    c, _ = augment(seed, 4, np.ones(2), np.random.default_rng(8))
    assert (a == b).all() and not (a == c).all()


def test_bad_seeds_are_refused(seed):
    """A seed of the wrong rank or with a NaN never becomes training data."""
    with pytest.raises(ValueError, match="shape"):
        augment(seed[0], 4, np.ones(2), np.random.default_rng(0))
    seed[1, 0, 3] = np.nan
    with pytest.raises(ValueError, match="finite"):
        augment(seed, 4, np.ones(2), np.random.default_rng(0))


def test_split_by_time_has_no_neighbours_across_the_cut_but_one():
    """All windows used once; in each recording every training window precedes every test window,
    so only the cut itself has neighbours on both sides (a shuffled split would have hundreds)."""
    counts = [160, 160, 100]
    train, test = split_by_time(counts)
    assert sorted([*train, *test]) == list(range(420))
    start = 0
    for n in counts:
        mine = range(start, start + n)
        early, late = [i for i in train if i in mine], [i for i in test if i in mine]
        assert len(early) == round(0.8 * n) and max(early) < min(late)
        start += n
    across = sum(abs(np.subtract.outer(train, test)).ravel() == 1)
    assert across == 2 * len(counts) - 1  # the cut, and the joint between stacked recordings


def test_a_single_draw_takes_the_same_random_numbers(seed):
    """Against the paper's augmentation written out: shifts first, then noise, nothing else; and one
    draw a class is the same as none."""
    x, _ = augment(seed, 6, np.ones(2), np.random.default_rng(4))
    rng = np.random.default_rng(4)
    shift = rng.integers(96, size=24)
    expected = np.array([np.roll(seed[k // 6], -shift[k], axis=-1) for k in range(24)], np.float32)
    expected += np.float32(0.15) * rng.standard_normal(expected.shape, dtype=np.float32)
    np.testing.assert_array_equal(x, remove_mean(expected))
    again, _ = augment(seed[:, None], 6, np.ones(2), np.random.default_rng(4))
    np.testing.assert_array_equal(x, again)


def test_many_draws_are_taken_at_random_from_the_right_class():
    """Each sample is one of its class's revolutions, marked by its amplitude, and all occur."""
    level = np.arange(1.0, 21.0).reshape(2, 10)
    draws = level[:, :, None, None] * np.sin(2 * np.pi * np.arange(64) / 64)
    x, y = augment(draws, 200, np.zeros(1), np.random.default_rng(0))
    found = np.round(x.max(axis=(1, 2)))
    for label in range(2):
        assert set(found[y == label]) == set(level[label])


@pytest.mark.parametrize(("count", "most"), [(20, 1), (35, 2)])
def test_samples_share_as_few_draws_as_can_be(count, most):
    """Of 20 draws 20 samples share none; of 35 some are of two samples, and all are there."""
    draws = np.arange(40.0).reshape(2, 20, 1, 1) * np.array([1.0, -1.0, 1.0, -1.0])
    x, y = augment(draws, count, np.zeros(1), np.random.default_rng(0))
    sizes = np.round(np.abs(x[:, 0]).max(axis=1))
    for label in (0, 1):
        _, times = np.unique(sizes[y == label], return_counts=True)
        assert len(times) == 20 and times.max() == most


def test_each_once_takes_every_revolution():
    """As many samples as revolutions, in class order, none of them twice."""
    level = np.arange(1.0, 9.0).reshape(2, 4)
    draws = level[:, :, None, None] * np.sin(2 * np.pi * np.arange(64) / 64)
    x, y = each_once(draws, np.zeros(1), np.random.default_rng(0))
    assert y.tolist() == [0] * 4 + [1] * 4
    np.testing.assert_allclose(x.max(axis=(1, 2)), level.ravel(), rtol=1e-2)
