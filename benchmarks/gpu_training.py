"""Seconds an epoch on a GPU: steps started kernel by kernel, as a replayed graph, and in turns.

    python benchmarks/gpu_training.py [NETWORK...]

Trains each network at the paper's size: 1000 samples a class, of two sensors in time or of one
image of 256 pixels, in bfloat16, in the batches of config/config.yaml. The samples are random
numbers: what they say changes no time. An epoch includes its validation; the first is not counted.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
import torch
import yaml

from rippletwin.learning.architectures import ARCHITECTURES
from rippletwin.learning.arithmetic import choose_arithmetic
from rippletwin.learning.markdown import markdown_table
from rippletwin.learning.networks import build
from rippletwin.learning.side_by_side import train_all
from rippletwin.learning.training import History, TrainingSettings, train_stepwise
from rippletwin.learning.training_steps import TrainingSteps

CONFIG = Path(__file__).parents[1] / "config/config.yaml"
EPOCHS = 3
CLASSES, SAMPLES = 4, 1000
SEEDS = 10


def time_epochs(name: str, seeds: int) -> float:
    """Seconds an epoch of this network, of so many trainings in turns."""
    architecture = ARCHITECTURES[name]
    shape = (2, 3072) if architecture.domain == "time" else (1, 256, 256)
    x = torch.rand((CLASSES * SAMPLES, *shape), device="cuda")
    y = np.repeat(np.arange(CLASSES), SAMPLES)
    given = yaml.safe_load(CONFIG.read_text())["training"][architecture.family]
    unending = {"target_loss": 0.0, "plateau": EPOCHS, "max_epochs": EPOCHS}
    settings = TrainingSettings(**given | unending)
    ends: dict[int, float] = {}

    def note_end(epoch: int, _: History) -> None:
        ends[epoch] = time.perf_counter()  # of the last training to end it

    trainings = (
        train_stepwise(
            build(name, shape[0]), x, y, settings, seed, note_end, choose_arithmetic(gpu=True)
        )
        for seed in range(seeds)
    )
    list(train_all(trainings, torch.device("cuda")))
    return (ends[EPOCHS - 1] - ends[0]) / (EPOCHS - 1)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("networks", nargs="*", default=list(ARCHITECTURES), metavar="NETWORK")
    names = parser.parse_args().networks
    if not torch.cuda.is_available():
        raise SystemExit("torch finds no GPU: there is nothing to measure")
    record, rows = TrainingSteps._record, []
    for name in names:
        TrainingSteps._record = lambda self: None
        times = [time_epochs(name, 1)]
        TrainingSteps._record = record
        times += [time_epochs(name, 1), time_epochs(name, SEEDS)]
        rows.append([ARCHITECTURES[name].title, *(f"{seconds:.2f}" for seconds in times)])
        print("\t".join(rows[-1]), flush=True)
    heads = ["network", "kernel by kernel", "graph", f"graphs of {SEEDS} in turns"]
    print(f"\n{torch.cuda.get_device_name()}, s an epoch\n\n{markdown_table(heads, rows)}")


if __name__ == "__main__":
    main()
