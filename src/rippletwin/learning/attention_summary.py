"""What one trained network looks at: simulated faults, and windows of recordings."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Mapping

import numpy as np

from rippletwin.learning.architectures import CLASSES
from rippletwin.learning.grad_cam import attention_density, attention_map, measure_alignment
from rippletwin.learning.networks import Classifier
from rippletwin.learning.training import predict


def fault_attention(
    network: Classifier, inputs: Mapping[str, np.ndarray], regions: Mapping[str, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Share of attention in each fault's region, and share of inputs without any: (faults,) each.

    inputs : fault -> noise-free inputs (n, channels, ...) of it; regions : fault -> booleans of
    `grad_cam.fault_region`. The share is the mean over inputs with attention, NaN where none has.
    """
    attended, blind = [], []
    for fault, region in regions.items():
        heat = attention_map(network, inputs[fault], CLASSES.index(fault))
        share = measure_alignment(heat, region)[0]
        attended.append(_mean_of_known(share))
        blind.append(np.isnan(share).mean())
    return np.array(attended), np.array(blind)


def recording_attention(network: Classifier, windows: np.ndarray) -> tuple[str, float, np.ndarray]:
    """What a network calls most windows of a recording, the share that it calls so, and its heat.

    windows : (n, channels, ...). The heat (...) is the mean attention density for that class over
    windows with attention; NaN where none has.
    """
    label, count = Counter(predict(network, windows)[0].tolist()).most_common(1)[0]
    density = attention_density(attention_map(network, windows, label))
    return CLASSES[label], count / len(windows), _mean_of_known(density)


def _mean_of_known(values: np.ndarray) -> np.ndarray:
    """Mean over the first axis of what is not NaN; NaN where all are."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Mean of empty slice", RuntimeWarning)
        return np.nanmean(values, axis=0)
