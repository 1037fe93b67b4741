"""How alike two time-frequency images are, wherever in the revolution each begins."""

from __future__ import annotations

import numpy as np


def image_similarity(first: np.ndarray, second: np.ndarray) -> tuple[float, float]:
    """Normalised correlation of two images, and the second's amplitude over the first's.

    first, second : (channels, rows, columns), zero where there is no energy, columns a whole number
    of revolutions. Correlation sum(a b) / sqrt(sum(a^2) sum(b^2)), largest over cyclic shifts of
    the second in time (the same for all channels), since neither crank angle is known. One for
    images that differ by a factor only, zero where no ridge meets another (energies have no sign);
    the factor is the second number, the ratio of root mean squares. Raises ValueError for an
    image without energy.
    """
    first, second = np.asarray(first, dtype=float), np.asarray(second, dtype=float)
    energies = np.square(first).sum(), np.square(second).sum()
    if not all(energies):
        raise ValueError("an image without energy is like nothing")
    # correlation over all shifts at once: a product of spectra along time
    product = np.fft.rfft(first).conj() * np.fft.rfft(second)
    correlation = np.fft.irfft(product.sum((0, 1)), first.shape[-1])
    return (
        float(correlation.max() / np.sqrt(energies[0] * energies[1])),
        float(np.sqrt(energies[1] / energies[0])),
    )
