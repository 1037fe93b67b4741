"""Processor time of training on 1000 samples, for each architecture and input size.

    OMP_NUM_THREADS=1 python benchmarks/training_speed.py [--sizes 32 48 64] [--batch 32] [--bf16]

Times are processor seconds of one thread, the best of three steps. The script starts itself again
with the memory settings of a training job.
"""

from __future__ import annotations

import argparse
import os
import sys
import time

import torch
from torch import nn

from rippletwin.learning.architectures import ARCHITECTURES
from rippletwin.learning.malloc_settings import MALLOC_ENVIRONMENT
from rippletwin.learning.networks import build


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", type=int, nargs="+", default=[32, 48, 64, 96])
    parser.add_argument("--batch", type=int, default=32)
    parser.add_argument("--only", nargs="+", default=list(ARCHITECTURES))
    parser.add_argument("--bf16", action="store_true")
    arguments = parser.parse_args()
    if not MALLOC_ENVIRONMENT.items() <= os.environ.items():
        os.execve(sys.executable, [sys.executable, *sys.argv], os.environ | MALLOC_ENVIRONMENT)

    torch.set_num_threads(1)
    print("| architecture | input | train, s/1000 | predict, s/1000 |\n|---|---|---|---|")
    for name in arguments.only:
        image = ARCHITECTURES[name].domain == "image"
        for shape in [(size, size) for size in arguments.sizes] if image else [(3072,)]:
            training, prediction = measure(name, (2, *shape), arguments.batch, arguments.bf16)
            size = "2 × " + " × ".join(map(str, shape))
            print(f"| {name} | {size} | {training:.2f} | {prediction:.2f} |", flush=True)


def measure(name: str, shape: tuple[int, ...], batch: int, bf16: bool) -> tuple[float, float]:
    """Milliseconds a sample (seconds a thousand) of a training step, and of a prediction."""
    network = build(name, shape[0])
    optimiser = torch.optim.Adam(network.parameters(), fused=True)
    x, y = torch.randn(batch, *shape), torch.randint(0, 4, (batch,))
    times = []
    for _ in range(4):
        start = time.process_time()
        with torch.autocast("cpu", torch.bfloat16, enabled=bf16):
            loss = nn.functional.cross_entropy(network(x), y)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        times.append(time.process_time() - start)
    start = time.process_time()
    with torch.no_grad(), torch.autocast("cpu", torch.bfloat16, enabled=bf16):
        network.eval()(x)
    return 1e3 * min(times[1:]) / batch, 1e3 * (time.process_time() - start) / batch


if __name__ == "__main__":
    main()
