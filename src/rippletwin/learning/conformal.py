"""Whether a window is unlike everything a network learnt: a p-value with a promised rate.

Nonconformity is the Mahalanobis distance to the nearest class, with one covariance for all classes,
of the activations of all layers (Lee, Lee, Lee & Shin 2018, NeurIPS 31). The last layer alone keeps
little of what tells no classes apart, such as a line that somebody changed. The distance's rank
among those of held-out samples is the p-value of split conformal prediction (Vovk, Gammerman &
Shafer 2005, Algorithmic Learning in a Random World, section 4.2): where a window is exchangeable
with the held-out samples, p <= r happens with a probability of at most r, whatever the network.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

PROMISED_RATE = 0.05  # of windows called unlike although they are like the simulated ones
SHRINKAGE = 1e-3  # of the covariance towards a multiple of unity: some features are always silent


@dataclass(frozen=True)
class Conformal:
    """Class means (C, D) and whitening (D, D) of features; held-out distances (n,), ascending."""

    means: np.ndarray
    whitening: np.ndarray
    distances: np.ndarray

    def distance(self, features: np.ndarray) -> np.ndarray:
        """Mahalanobis distance (m,) of features (m, D) to the nearest class."""
        apart = (features[:, None] - self.means) @ self.whitening
        return np.sqrt(np.min(np.sum(apart**2, axis=-1), axis=1))

    def p_values(self, features: np.ndarray) -> np.ndarray:
        """Conformal p-values (m,) of features (m, D)."""
        nearer = np.searchsorted(self.distances, self.distance(features), side="left")
        return (1 + len(self.distances) - nearer) / (1 + len(self.distances))


def fit_conformal(features: np.ndarray, labels: np.ndarray, held_out: np.ndarray) -> Conformal:
    """The p-value of a network from features (n, D) of samples with class `labels` (n,), and from
    those (m, D) of samples that neither the network nor these classes have seen.

    Raises ValueError where `held_out` are too few for the promised rate.
    """
    if len(held_out) < 1.0 / PROMISED_RATE - 1.0:
        raise ValueError(f"{len(held_out)} held-out samples cannot promise {PROMISED_RATE}")
    features, held_out = np.asarray(features, float), np.asarray(held_out, float)
    means = np.array([features[labels == k].mean(axis=0) for k in np.unique(labels)])
    residual = features - means[np.unique(labels, return_inverse=True)[1]]
    covariance = residual.T @ residual / len(features)
    size = max(np.trace(covariance) / len(covariance), np.finfo(float).tiny)
    values, vectors = np.linalg.eigh(covariance + SHRINKAGE * size * np.eye(len(covariance)))
    whitening = vectors / np.sqrt(values)
    unsorted = Conformal(means, whitening, np.empty(0)).distance(held_out)
    return Conformal(means, whitening, np.sort(unsorted))
