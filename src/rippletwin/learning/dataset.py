"""Training samples from simulated seeds, and the split of recordings by time.

The paper's augmentation: one simulated revolution for each class becomes many samples by a random
cyclic shift (there is no tachometer: the crank angle of a window's first point is unknown) and
Gaussian noise. Where many revolutions of a class have been simulated, each sample is one of them.
Only the mean is removed: the amplitude carries the information on the fault, so nothing is
normalised.
"""

from __future__ import annotations

import numpy as np

UNKNOWN = "?"  # state of a recording to be diagnosed
NOISE_FRACTION = 0.15  # of the estimated sensor noise (the paper's augmentation)


def augment(
    seed: np.ndarray,
    samples_per_class: int,
    noise_std: np.ndarray,
    rng: np.random.Generator,
    revolutions: int = 1,
    noise_fraction: float = NOISE_FRACTION,
) -> tuple[np.ndarray, np.ndarray]:
    """Shifted, noisy, mean-free samples of the seed revolutions of each class.

    seed : (classes, channels, M), one whole revolution, or (classes, draws, channels, M), many of
        which each sample takes one at random; Pa or m3/s.
    noise_std : (channels,) estimated standard deviation of the sensor noise, the seed's unit;
        ``noise_fraction`` of it is added.
    revolutions : length of a sample; the signal repeats, its noise does not.

    Returns x (classes * samples_per_class, channels, M * revolutions) float32 and
    y (classes * samples_per_class,), in class order. Raises ValueError for shapes that disagree or
    for a seed that is not finite.
    """
    seed = np.asarray(seed, dtype=float)
    if seed.ndim not in (3, 4):
        raise ValueError(f"seed must be (classes, [draws,] channels, M), got shape {seed.shape}")
    seed = seed if seed.ndim == 4 else seed[:, None]
    classes, draws, channels, points = seed.shape
    noise_std = np.broadcast_to(np.asarray(noise_std, dtype=float), (channels,))
    if not (np.isfinite(seed).all() and np.isfinite(noise_std).all()):
        raise ValueError("seed and noise_std must be finite")

    y = np.repeat(np.arange(classes), samples_per_class)
    shift = rng.integers(points, size=y.size)
    drawn = np.concatenate([_draw(draws, samples_per_class, rng) for _ in range(classes)])
    at = (np.arange(points * revolutions) + shift[:, None]) % points
    x = np.empty((y.size, channels, points * revolutions), dtype=np.float32)
    for label in range(classes):
        of_class = y == label
        x[of_class] = np.take_along_axis(seed[label, drawn[of_class]], at[of_class, None], axis=-1)
    std = (noise_fraction * noise_std).astype(np.float32)
    x += std[:, None] * rng.standard_normal(x.shape, dtype=np.float32)
    return remove_mean(x), y


def _draw(draws: int, count: int, rng: np.random.Generator) -> np.ndarray:
    """Which of the draws of a class its samples (count,) are of: each as often as any other, to
    one, so that no more samples than draws share none."""
    if draws == 1:
        return np.zeros(count, int)
    rounds = [rng.permutation(draws) for _ in range(-(-count // draws))]
    return np.concatenate(rounds)[:count]


def each_once(
    signals: np.ndarray,
    noise_std: np.ndarray,
    rng: np.random.Generator,
    noise_fraction: float = NOISE_FRACTION,
) -> tuple[np.ndarray, np.ndarray]:
    """One sample of every revolution of signals (classes, draws, channels, M), as ``augment`` makes
    them: x (classes * draws, channels, M) and y (classes * draws,), in class order."""
    classes, draws, *shape = signals.shape
    x, y = augment(signals.reshape(classes * draws, *shape), 1, noise_std, rng, 1, noise_fraction)
    return x, y // draws


def remove_mean(x: np.ndarray) -> np.ndarray:
    """x (..., M) less its mean along the last axis, for recordings and samples alike."""
    return x - x.mean(axis=-1, keepdims=True)


def split_by_time(
    n_per_recording: list[int] | np.ndarray, fraction: float = 0.8
) -> tuple[np.ndarray, np.ndarray]:
    """Early windows of each recording for training, late ones for testing: indices (a,), (b,).

    n_per_recording : windows of each recording, in the order in which they are stacked.

    Neighbouring windows are on one side, unlike after shuffling.
    """
    train, test, start = [], [], 0
    for n in n_per_recording:
        cut = round(fraction * n)
        train.append(np.arange(start, start + cut))
        test.append(np.arange(start + cut, start + n))
        start += n
    return np.concatenate(train), np.concatenate(test)
