"""Grad-CAM of a classifier, and its alignment with the fault.

Grad-CAM (Selvaraju et al. 2017, eq. 1 and 2): the last feature maps A_k, weighted by the mean
gradient of the class's logit and summed; negative parts are set to zero. All networks here end in
global average pooling and one linear layer, for which the mean gradient is that layer's weight over
the number of positions: no backward pass is needed (their section 3.1). Agrees with captum's
LayerGradCam.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import nn

from rippletwin.learning.networks import BATCH, Classifier


@torch.no_grad()
def grad_cam(network: Classifier, x: np.ndarray, target: np.ndarray | int) -> np.ndarray:
    """Coarse Grad-CAM (n, rows, columns) on the grid of the last feature maps (one row in time).

    x : inputs as the network takes them; target : (n,) or one class index, whose evidence is shown.
    In logits; comparable between inputs of one network, not between networks.
    """
    network.eval()
    targets = torch.as_tensor(np.broadcast_to(target, len(x)).copy())
    heats = []
    for inputs, classes in zip(
        torch.as_tensor(x, dtype=torch.float32).split(BATCH), targets.split(BATCH)
    ):
        maps = network.feature_maps(inputs)
        weight = network.head.weight[classes.to(maps.device)] / maps[0, 0].numel()
        heats.append(torch.einsum("nkhw,nk->nhw", maps, weight).relu())
    return torch.cat(heats).cpu().numpy()


def attention_map(network: Classifier, x: np.ndarray, target: np.ndarray | int) -> np.ndarray:
    """Grad-CAM at the resolution of the input: (n, M) or (n, size, size), linear in between.

    Each feature is put where its receptive field is centred; on time windows, which are whole
    revolutions, positions wrap, and where the cyclic padding shows a place twice its mean counts.
    """
    coarse = grad_cam(network, x, target)
    cyclic = network.architecture.domain == "time"
    to_columns = _spread(network, coarse.shape[2], np.shape(x)[-1], axis=1, cyclic=cyclic)
    fine = coarse @ to_columns.T
    if cyclic:
        return fine[:, 0]
    return _spread(network, coarse.shape[1], np.shape(x)[-2], axis=0, cyclic=False) @ fine


def attention_density(heat: np.ndarray) -> np.ndarray:
    """Heat (n, ...) over its mean in each input: 1 where attention is spread evenly.

    Unlike logits, it compares between networks. NaN for an input without any attention.
    """
    mean = heat.reshape(len(heat), -1).mean(1).reshape(-1, *[1] * (heat.ndim - 1))
    with np.errstate(invalid="ignore"):
        return np.where(mean > 0, heat / mean, np.nan)


def fault_region(healthy: np.ndarray, faulty: np.ndarray, energy: float = 0.5) -> np.ndarray:
    """Region of a fault: the fewest places with the share ``energy`` of the squared difference.

    healthy, faulty : noise-free inputs at the same crank angle. Windows (n, channels, M) give crank
    angles, booleans (n, M); images (n, channels, rows, columns) give frequencies, (n, rows), since
    the instant within a revolution means nothing for a fault that every revolution repeats. Raises
    ValueError for equal inputs.
    """
    difference = np.square(np.asarray(faulty, dtype=float) - healthy).sum(1)
    if difference.ndim == 3:
        difference = difference.sum(-1)
    total = difference.sum(1, keepdims=True)
    if not total.all():
        raise ValueError("a faulty input equals the healthy one: there is no region to attend to")
    order = np.argsort(-difference, axis=1)
    share = np.cumsum(np.take_along_axis(difference, order, 1), 1) / total
    inside = np.zeros_like(difference, dtype=bool)
    # A place is inside while the stronger ones together have less than the share.
    np.put_along_axis(inside, order, np.pad(share[:, :-1], ((0, 0), (1, 0))) < energy, 1)
    return inside


def measure_alignment(heat: np.ndarray, region: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Share of the attention that falls into the region, and share that the region is of all.

    heat : of ``attention_map``, (n, M) or (n, rows, columns); region : of ``fault_region``,
    booleans (n, M) or (n, rows). Returns two arrays (n,). Attention that looks everywhere alike has
    equal shares: their ratio is one, more means it seeks the fault. NaN where there is no attention
    at all (no positive evidence for the class).
    """
    if heat.ndim == 3:
        heat = heat.sum(-1)
    total = heat.sum(1)
    with np.errstate(invalid="ignore"):
        attended = np.where(total > 0, (heat * region).sum(1) / total, np.nan)
    return attended, region.mean(1)


def feature_positions(network: Classifier, count: int, axis: int) -> np.ndarray:
    """Centre of each of ``count`` features' receptive fields along rows (0) or columns (1), in
    samples or pixels of the input; outside the input where padding is."""
    start, jump = 0.0, 1.0
    for name, layer in network.features.named_modules():
        if isinstance(layer, nn.Conv2d | nn.MaxPool2d) and "shortcut" not in name:
            kernel, stride, padding = (
                int(value if isinstance(value, int) else value[axis])
                for value in (layer.kernel_size, layer.stride, layer.padding)
            )
            start += jump * ((kernel - 1) / 2 - padding)
            jump *= stride
    return start + jump * np.arange(count)


def _spread(network: Classifier, count: int, points: int, axis: int, cyclic: bool) -> np.ndarray:
    """(points, count) linear interpolation from the features' positions to the input's."""
    positions = feature_positions(network, count, axis)
    jump = positions[1] - positions[0] if count > 1 else 1.0
    images = np.arange(points) + (points * np.array([[-1], [0], [1]]) if cyclic else [[0]])
    seen = (images >= positions[0]) & (images <= positions[-1])
    seen[len(images) // 2] |= ~seen.any(0)  # beyond the outermost feature take its value
    weights = np.zeros((points, count))
    for at, counts in zip(images, seen):
        place = np.clip((at - positions[0]) / jump, 0, count - 1)
        below = np.minimum(place.astype(int), max(count - 2, 0))
        above = np.minimum(below + 1, count - 1)
        np.add.at(weights, (np.arange(points), below), counts * (1 - place + below))
        np.add.at(weights, (np.arange(points), above), counts * (place - below))
    return weights / seen.sum(0)[:, None]
