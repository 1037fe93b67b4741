"""An epoch of training in two forms: the tool's, and a plain float32 loop of the same network.

    python -m speed.training_loops plain|tool NETWORK SAMPLES SIZE...

Runs an epoch for each line that it reads, and answers with its processor seconds.
"""

from __future__ import annotations

import sys
import time

import numpy as np
import torch
from torch import nn

from rippletwin.learning.architectures import ARCHITECTURES, Architecture
from rippletwin.learning.arithmetic import choose_arithmetic
from rippletwin.learning.networks import MAPS, build
from rippletwin.learning.training import TrainingSettings, train

BATCH = 16
FIT_SHARE = 0.8  # of the samples; the rest are held out


def plain_network(a: Architecture, channels: int) -> nn.Sequential:
    """The architecture as it is usually written: 1D convolutions on windows, contiguous tensors."""
    time = a.domain == "time"
    convolution, normalise = (nn.Conv1d, nn.BatchNorm1d) if time else (nn.Conv2d, nn.BatchNorm2d)
    pool = nn.MaxPool1d if time else nn.MaxPool2d
    mode = "circular" if time else "zeros"
    first = convolution(
        channels, MAPS, a.kernel, a.stride, a.padding, bias=not a.blocks, padding_mode=mode
    )
    if not a.blocks:
        second = convolution(MAPS, MAPS, 3, 1, 1)
        pools = (pool(3, 2, 1), pool(3, 1, 1)) if time else (pool(2), pool(2))
        layers = [first, nn.ReLU(inplace=True), pools[0]]
        layers += [second, nn.ReLU(inplace=True), pools[1]]
        width = MAPS
    else:
        layers = [first, normalise(MAPS), nn.ReLU(inplace=True), pool(3, 2, 1)]
        width = MAPS
        for stage, blocks in enumerate(a.blocks):
            for block in range(blocks):
                stride = 2 if stage and not block else 1
                layers.append(PlainBlock(convolution, normalise, width, MAPS * 2**stage, stride))
                width = MAPS * 2**stage
    average = nn.AdaptiveAvgPool1d(1) if time else nn.AdaptiveAvgPool2d(1)
    return nn.Sequential(*layers, average, nn.Flatten(), nn.Linear(width, 4))


class PlainBlock(nn.Module):
    """A basic residual block."""

    def __init__(self, convolution, normalise, width_in: int, width: int, stride: int):
        super().__init__()
        self.residual = nn.Sequential(
            convolution(width_in, width, 3, stride, 1, bias=False),
            normalise(width),
            nn.ReLU(inplace=True),
            convolution(width, width, 3, 1, 1, bias=False),
            normalise(width),
        )
        self.shortcut = nn.Identity()
        if stride != 1 or width_in != width:
            self.shortcut = nn.Sequential(
                convolution(width_in, width, 1, stride, bias=False), normalise(width)
            )

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return torch.relu(self.residual(x) + self.shortcut(x))


def plain_epoch(name: str, x: np.ndarray, y: np.ndarray) -> None:
    """One epoch of a loop as tutorials have it, with its validation."""
    network = plain_network(ARCHITECTURES[name], x.shape[1])
    optimiser = torch.optim.Adam(network.parameters())
    images, labels = torch.as_tensor(x), torch.as_tensor(y)
    order = torch.randperm(len(x)).split([round(FIT_SHARE * len(x)), round(len(x) / 5)])
    network.train()
    for batch in order[0].split(BATCH):
        optimiser.zero_grad()
        loss = nn.functional.cross_entropy(network(images[batch]), labels[batch])
        loss.backward()
        optimiser.step()
    network.eval()
    with torch.no_grad():
        for batch in order[1].split(BATCH):
            nn.functional.cross_entropy(network(images[batch]), labels[batch])


def tool_epoch(name: str, x: np.ndarray, y: np.ndarray) -> None:
    """One epoch of the tool's training as it is configured by default, its validation included."""
    settings = TrainingSettings(batch_size=BATCH, max_epochs=1, validation_fraction=1 - FIT_SHARE)
    arithmetic = choose_arithmetic(gpu=False)
    train(build(name, x.shape[1]), x, y, settings, seed=0, arithmetic=arithmetic)


def samples(count: int, shape: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Noise (count, 2, *shape) of four classes that differ in size."""
    rng = np.random.default_rng(0)
    y = np.arange(count) % 4
    x = rng.standard_normal((count, 2, *shape)).astype(np.float32)
    return x * (1 + y).reshape(-1, *(1,) * (x.ndim - 1)).astype(np.float32), y


def main() -> None:
    loop, name, count, *shape = sys.argv[1:]
    torch.set_num_threads(1)
    x, y = samples(int(count), tuple(map(int, shape)))
    epoch = {"plain": plain_epoch, "tool": tool_epoch}[loop]
    for _ in sys.stdin:
        start = time.process_time()
        epoch(name, x, y)
        print(time.process_time() - start, flush=True)


if __name__ == "__main__":
    main()
