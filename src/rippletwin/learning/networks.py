"""The ten classifiers of the paper: plain and residual networks on time windows and on images.

Their numbers are those of `architectures`; docs/explanation/learning.md explains how the paper's
tables are read where they leave a choice. A time window is convolved as an image of one row: the
same arithmetic as a 1D convolution, for which the CPU kernels of torch are up to twice as fast in
channels-last order.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import torch
from torch import nn

from rippletwin import store
from rippletwin.learning.architectures import ARCHITECTURES, CLASSES, Architecture
from rippletwin.learning.convolution import Convolution

MAPS = 64  # feature maps of every plain layer and of the first residual stage
BATCH = 64  # inputs that a trained network answers at once


def build(name: str, channels: int) -> Classifier:
    """A fresh network, initialised from torch's global generator.

    name : a key of ``ARCHITECTURES``; channels : 2 for two pressure sensors, 1 for the outlet flow.
    Raises KeyError for an unknown name.
    """
    architecture = ARCHITECTURES[name]
    network = Classifier(architecture, channels)
    return network.to(memory_format=torch.channels_last)  # type: ignore[call-overload]


def restore_networks(
    name: str,
    channels: int,
    weights: Iterable[dict],
    device: torch.device | str = "cpu",
) -> Iterator[Classifier]:
    """Trained networks of an architecture, one for each of `weights` (their state dictionaries).

    name, channels : as for ``build``; device : where they calculate. Raises KeyError for an unknown
    name, RuntimeError for weights of another architecture.
    """
    for state in weights:
        network = build(name, channels)
        network.load_state_dict(state)
        yield network.to(device)


def save_tensors(data: list | dict, path: str | Path) -> None:
    """Write tensors in lists and dictionaries to `path`, whole or not at all."""
    # Through an open file: by name, torch writes the name into the file.
    with store.whole(path) as scratch, scratch.open("wb") as file:
        torch.save(data, file)


class Classifier(nn.Module):
    """Feature maps, global average pooling, one linear layer: logits (n, classes).

    ``scale`` is the only standardisation: one number for all samples, channels and times, since the
    amplitude carries the diagnosis. Training sets it to the root mean square of its inputs less
    silence. Silence is subtracted first, so that zero padding is silence in images too.
    """

    scale: torch.Tensor

    def __init__(self, architecture: Architecture, channels: int):
        super().__init__()
        self.architecture = architecture
        self.register_buffer("scale", torch.ones(()))
        layers = _residual if architecture.blocks else _plain
        self.features, width = layers(architecture, channels)
        self.pool = nn.AdaptiveAvgPool2d(1)
        self.head = nn.Linear(width, len(CLASSES))

    def feature_maps(self, x: torch.Tensor) -> torch.Tensor:
        """x (n, channels, M) or (n, channels, size, size) in the data's own unit -> the last maps
        (n, width, rows, columns), one row for time windows."""
        return self.features(self.standardise(x))

    def standardise(self, x: torch.Tensor) -> torch.Tensor:
        """x as ``feature_maps`` takes it -> (n, channels, rows, columns) in channels-last order,
        on the network's device, silence subtracted and divided by ``scale``."""
        if self.architecture.domain == "time":
            x = x.unsqueeze(-2)
        x = (x.to(self.scale.device) - self.architecture.silence) / self.scale
        return x.contiguous(memory_format=torch.channels_last)

    def activation_statistics(self, x: torch.Tensor) -> torch.Tensor:
        """x as ``feature_maps`` takes it -> mean and standard deviation (n, 2 maps) of every map
        behind every activation of ``features``"""
        statistics = []
        x = self.standardise(x)
        for layer in self.features:
            x = layer(x)
            if isinstance(layer, nn.ReLU | BasicBlock):
                statistics += [x.mean((2, 3)), x.std((2, 3))]
        return torch.cat(statistics, 1)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """x as ``feature_maps`` takes it -> logits (n, classes)"""
        return self.answer(self.standardise(x))

    def answer(self, standardised: torch.Tensor) -> torch.Tensor:
        """What ``standardise`` gives -> logits (n, classes)"""
        return self.head(self.pool(self.features(standardised)).flatten(1))


def _plain(a: Architecture, channels: int) -> tuple[nn.Sequential, int]:
    pools = (
        (nn.MaxPool2d((1, 3), (1, 2), (0, 1)), nn.MaxPool2d((1, 3), 1, (0, 1)))
        if a.domain == "time"
        else (nn.MaxPool2d(2), nn.MaxPool2d(2))
    )
    layers = []
    for convolution, pool in zip((_first(a, channels), _same(a.domain, MAPS, MAPS)), pools):
        # The greatest of a pool's inputs stays the greatest behind a ReLU, so that their order does
        # not matter, but this one has fewer numbers to pass.
        layers += [convolution, pool, nn.ReLU(inplace=True)]
    return nn.Sequential(*layers), MAPS


def _residual(a: Architecture, channels: int) -> tuple[nn.Sequential, int]:
    """He et al. 2016, table 1, basic blocks; the first convolution is the architecture's."""
    pool = nn.MaxPool2d((1, 3), (1, 2), (0, 1)) if a.domain == "time" else nn.MaxPool2d(3, 2, 1)
    layers = [
        _first(a, channels, bias=False),
        nn.BatchNorm2d(MAPS),
        nn.ReLU(inplace=True),
        pool,
    ]
    width = MAPS
    for stage, blocks in enumerate(a.blocks):
        stage_width = MAPS * 2**stage
        for block in range(blocks):
            stride = 2 if stage and not block else 1
            layers.append(BasicBlock(a.domain, width, stage_width, stride))
            width = stage_width
    return nn.Sequential(*layers), width


class BasicBlock(nn.Module):
    """relu(x + F(x)), F two convolutions of three taps; x is projected where the shape changes."""

    def __init__(self, domain: str, width_in: int, width: int, stride: int):
        super().__init__()
        self.residual = nn.Sequential(
            _same(domain, width_in, width, stride, bias=False),
            nn.BatchNorm2d(width),
            nn.ReLU(inplace=True),
            _same(domain, width, width, bias=False),
            nn.BatchNorm2d(width),
        )
        self.shortcut: nn.Module = nn.Identity()
        if stride != 1 or width_in != width:
            strides = (1, stride) if domain == "time" else stride
            self.shortcut = nn.Sequential(
                Convolution(width_in, width, 1, strides, bias=False), nn.BatchNorm2d(width)
            )
        self.activation = nn.ReLU(inplace=True)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return self.activation(self.residual(x) + self.shortcut(x))


def _first(a: Architecture, channels: int, bias: bool = True) -> Convolution:
    if a.domain == "time":
        kernel, stride, padding = (1, a.kernel), (1, a.stride), (0, a.padding)
        return Convolution(channels, MAPS, kernel, stride, padding, bias=bias, cyclic=True)
    return Convolution(channels, MAPS, a.kernel, a.stride, a.padding, bias=bias)


def _same(
    domain: str, width_in: int, width: int, stride: int = 1, bias: bool = True
) -> Convolution:
    """Three taps (3 x 3 in an image), padded so that stride 1 keeps the shape."""
    if domain == "time":
        return Convolution(width_in, width, (1, 3), (1, stride), (0, 1), bias=bias)
    return Convolution(width_in, width, 3, stride, 1, bias=bias)
