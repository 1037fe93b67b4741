"""Whether a window is unlike everything a network learnt: a p-value with a promised rate.

Nonconformity is how far the window's activations are from the nearest learnt samples, over how far
those are from theirs: a local outlier factor (Breunig, Kriegel, Ng & Sander 2000, SIGMOD, in its
plain form). Samples of severe faults lie wider apart than those of slight ones; the ratio allows
for it. Distances are Mahalanobis', over the activations of all layers, with one covariance for all
classes (Lee, Lee, Lee & Shin 2018, NeurIPS 31): the last layer alone keeps little of what tells no
classes apart, such as a line that somebody changed. The rank among held-out samples is the p-value
of split conformal prediction (Vovk, Gammerman & Shafer 2005, Algorithmic Learning in a Random
World, section 4.2): where a window is exchangeable with the held-out samples, p <= r happens with a
probability of at most r, whatever the network.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

PROMISED_RATE = 0.05  # of windows called unlike although they are like the simulated ones
NEIGHBOURS = 5
SHRINKAGE = 1e-3  # of the covariance towards a multiple of unity: some features are always silent
MOST_FEATURES = 256
"""More are projected at random onto so many: it keeps distances (Johnson & Lindenstrauss 1984)."""
BATCH = 512  # windows whose distances are held at once


@dataclass(frozen=True)
class Conformal:
    """What p-values follow from.

    whitening  (D, R) from features to coordinates in which the covariance is unity
    learnt     (n, R) samples that the network has learnt from
    spacing    (n,) mean distance of each to its nearest others
    scores     (m,) nonconformity of the held-out samples, ascending
    """

    whitening: np.ndarray
    learnt: np.ndarray
    spacing: np.ndarray
    scores: np.ndarray

    def nonconformity(self, features: np.ndarray) -> np.ndarray:
        """Mean distance (k,) of features (k, D) to the nearest learnt samples, over theirs."""
        distances, nearest = _nearest(features @ self.whitening, self.learnt, NEIGHBOURS)
        return distances.mean(axis=1) / self.spacing[nearest].mean(axis=1)

    def p_values(self, features: np.ndarray) -> np.ndarray:
        """Conformal p-values (k,) of features (k, D)."""
        smaller = np.searchsorted(self.scores, self.nonconformity(features), side="left")
        return (1 + len(self.scores) - smaller) / (1 + len(self.scores))


def fit_conformal(features: np.ndarray, labels: np.ndarray, held_out: np.ndarray) -> Conformal:
    """The p-value of a network from features (n, D) of learnt samples with class `labels` (n,), and
    from those (m, D) of samples that it has not learnt.

    Raises ValueError where `held_out` are too few for the promised rate.
    """
    if len(held_out) < 1.0 / PROMISED_RATE - 1.0:
        raise ValueError(f"{len(held_out)} held-out samples cannot promise {PROMISED_RATE}")
    features, held_out = np.asarray(features, float), np.asarray(held_out, float)
    whitening = _whitening(features, labels).astype(np.float32)  # it is kept in a file
    learnt = (features @ whitening).astype(np.float32)
    distances, _ = _nearest(learnt, learnt, NEIGHBOURS + 1)  # the first is the sample itself
    spacing = np.maximum(distances[:, 1:].mean(axis=1), np.finfo(float).tiny)
    unsorted = Conformal(whitening, learnt, spacing, np.empty(0)).nonconformity(held_out)
    return Conformal(whitening, learnt, spacing, np.sort(unsorted))


def _whitening(features: np.ndarray, labels: np.ndarray) -> np.ndarray:
    """(D, R) that makes the covariance within the classes unity."""
    count = features.shape[1]
    projection = np.eye(count)
    if count > MOST_FEATURES:
        normal = np.random.default_rng(0).standard_normal((count, MOST_FEATURES))
        projection = normal / np.sqrt(MOST_FEATURES)
    seen = features @ projection
    classes, of_class = np.unique(labels, return_inverse=True)
    means = np.array([seen[of_class == k].mean(axis=0) for k in range(len(classes))])
    residual = seen - means[of_class]
    covariance = residual.T @ residual / len(seen)
    size = max(np.trace(covariance) / len(covariance), np.finfo(float).tiny)
    values, vectors = np.linalg.eigh(covariance + SHRINKAGE * size * np.eye(len(covariance)))
    return projection @ (vectors / np.sqrt(values))


def _nearest(points: np.ndarray, others: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Distances (k, count), ascending, of points (k, R) to the nearest of others, and which."""
    distances, nearest = [], []
    for start in range(0, len(points), BATCH):
        apart = cdist(points[start : start + BATCH], others)
        at = np.argpartition(apart, count - 1, axis=1)[:, :count]
        at = np.take_along_axis(at, np.argsort(np.take_along_axis(apart, at, 1), axis=1), 1)
        distances.append(np.take_along_axis(apart, at, 1))
        nearest.append(at)
    return np.concatenate(distances), np.concatenate(nearest)
