"""Training steps, against the same network in a plain float32 loop."""

from __future__ import annotations

import math
import os
import subprocess
import sys

import numpy as np
import torch
from torch import nn

from rippletwin.learning.arithmetic import multiplies_bfloat16
from rippletwin.learning.malloc_settings import MALLOC_ENVIRONMENT
from rippletwin.learning.networks import build
from speed import machine
from speed.result import Claim, Result, Table
from speed.timing import median_ratio
from speed.training_loops import BATCH, FIT_SHARE

CASES = (
    ("cnn2d_3_1", (64, 64), "2D at 64 pixels"),
    ("cnn2d_30_3", (64, 64), "2D at 64 pixels"),
    ("resnet18_2d", (64, 64), "2D at 64 pixels"),
    ("cnn2d_3_1", (256, 256), "2D at 256 pixels"),
    ("cnn1d_3_1", (3072,), "1D"),
    ("cnn1d_341_100", (3072,), "1D"),
    ("resnet18_1d", (3072,), "1D"),
)


def operations(network: nn.Module, x: torch.Tensor) -> tuple[float, float]:
    """Multiplications and additions of the convolutions for one sample: of a training step, and of
    a prediction. A step is three times the forward pass, twice in the first layer, whose input
    needs no gradient."""
    forward: list[float] = []

    def count(layer, inputs, output):
        forward.append(2.0 * layer.weight[0].numel() * output[0].numel())

    hooks = [m.register_forward_hook(count) for m in network.modules() if isinstance(m, nn.Conv2d)]
    with torch.no_grad():
        network.eval()(x)
    for hook in hooks:
        hook.remove()
    return 3 * sum(forward) - forward[0], sum(forward)


class Loop:
    """One of the two loops in a process of its own, since the allocator's settings are fixed when
    a process starts. `epoch` runs an epoch there and returns its processor seconds."""

    def __init__(self, loop: str, name: str, shape: tuple[int, ...], count: int):
        environment = {k: v for k, v in os.environ.items() if k not in MALLOC_ENVIRONMENT}
        if loop == "tool":
            environment |= MALLOC_ENVIRONMENT
        self.process = subprocess.Popen(
            [sys.executable, "-m", "speed.training_loops", loop, name, str(count)]
            + [str(size) for size in shape],
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def epoch(self) -> float:
        self.process.stdin.write("epoch\n")
        self.process.stdin.flush()
        return float(self.process.stdout.readline())

    def end(self) -> None:
        self.process.communicate()


def compare(name: str, shape: tuple[int, ...], rate: float, quick: bool) -> tuple[float, list[str]]:
    """Ratio of the times of an epoch, and a row of the table."""
    # so many that drawing the first weights, which both loops do, takes little of an epoch
    large = math.prod(shape) > 2**14
    count, rounds = (20, 1) if quick else (40 if large else 320, 3)
    loops = {loop: Loop(loop, name, shape, count) for loop in ("plain", "tool")}
    for loop in loops.values():
        loop.epoch()  # what is allocated once
    times = np.array([[loop.epoch() for loop in loops.values()] for _ in range(rounds)])
    for loop in loops.values():
        loop.end()
    network = build(name, 2)
    step, prediction = operations(network, torch.zeros(1, 2, *shape))
    needed = FIT_SHARE * step + (1 - FIT_SHARE) * prediction
    plain, tool = np.median(times, 0) / count
    row = [
        name,
        "2 × " + " × ".join(map(str, shape)),
        f"{1e3 * plain:.3g}",
        f"{1e3 * tool:.3g}",
        f"{plain / tool:.2g}",
        f"{100 * needed / tool / rate:.0f} %",
    ]
    return median_ratio(times[:, 0], times[:, 1]), row


def run(quick: bool = False) -> Result:
    """Time of an epoch of both loops for several architectures."""
    torch.set_num_threads(1)
    bfloat16 = multiplies_bfloat16()
    targets = {
        "2D at 256 pixels": 5.0 if bfloat16 else 1.5,
        "2D at 64 pixels": 3.0 if bfloat16 else 1.5,
        "1D": 2.0,
    }
    rate = machine.product_rate(bfloat16)
    kind = "bfloat16" if bfloat16 else "float32"
    rows, ratios = [], {group: [] for group in targets}
    for name, shape, group in CASES:
        if quick and (math.prod(shape) > 4096 or "resnet" in name):
            continue
        ratio, row = compare(name, shape, rate, quick)
        rows.append(row)
        ratios[group].append(ratio)
    claims = [
        Claim(
            f"{group}: time of a plain float32 loop over that of the tool's, least of the networks",
            min(found) if found else None,
            targets[group],
        )
        for group, found in ratios.items()
    ]
    return Result(
        point=5,
        title="Training",
        what=[
            f"An epoch in batches of {BATCH}, one thread. The plain loop has torch's default "
            "layout, allocator and optimiser, and 1D convolutions on time windows. Both epochs "
            "end with the validation on a fifth of the samples.",
            f"The processor has {'' if bfloat16 else 'no '}bfloat16 instructions, which sets the "
            f"targets of 2D networks; the tool's products are {kind}.",
        ],
        claims=claims,
        tables=[
            Table(
                "Seconds for 1000 samples",
                ["network", "input", "plain", "tool", "ratio", "of the product rate"],
                rows,
            )
        ],
        bound=[
            f"torch multiplies large {kind} matrices at {rate / 1e9:.0f} GFLOP/s on one "
            "thread. The last column is the rate of the convolutions' operations, forward and "
            "backward, over that. What the product's rate leaves is the most that a faster step "
            "could gain without fewer or narrower operations."
        ],
    )
