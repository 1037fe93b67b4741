"""What each training of a finished default run costs, and the least that their products take."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
import torch
import yaml

from rippletwin.learning.architectures import ARCHITECTURES, CLASSES
from rippletwin.learning.arithmetic import multiplies_bfloat16
from rippletwin.learning.networks import build
from speed import machine
from speed.result import Table
from speed.training import operations
from speed.training_loops import FIT_SHARE

CONFIG = Path(__file__).resolve().parents[2] / "config"
CHANNELS = {"pressure": 2, "flow": 1}  # of the virtual rig: its sensors, and the outlet's flow


def training_seconds(results: Path) -> pd.DataFrame:
    """Wall seconds of all seeds of each network (rows, the costliest first) on each dataset."""
    seconds: dict[str, dict[str, float]] = {}
    for path in sorted((results / "benchmarks" / "train").rglob("*.tsv")):
        wall = float(pd.read_csv(path, sep="\t")["s"].iloc[0])
        seconds.setdefault(path.parent.name, {})[path.stem] = wall
    found = pd.DataFrame(seconds)
    return found.loc[found.sum(axis=1).sort_values(ascending=False).index]


def training_table(caption: str, seconds: pd.DataFrame) -> Table:
    """`training_seconds` as rows of texts, with sums."""
    rows = [
        [network, *(_text(x) for x in row), f"{row.sum():.0f}"]
        for network, row in seconds.iterrows()
    ]
    total = ["all", *(f"{x:.0f}" for x in seconds.sum()), f"{seconds.sum().sum():.0f}"]
    return Table(caption, ["network", *seconds.columns, "all"], [*rows, total])


def operations_of_run(results: Path) -> float:
    """Multiplications and additions of the convolutions in all trainings on simulated samples, by
    the epochs that their histories have and the sample counts of config.yaml."""
    config = yaml.safe_load((CONFIG / "config.yaml").read_text())
    datasets = pd.read_csv(CONFIG / "datasets.tsv", sep="\t", index_col="name")
    per_class, total = config["samples_per_class"], 0.0
    for path in sorted((results / "models").rglob("*.json")):
        dataset, domain = datasets.loc[path.parent.name], ARCHITECTURES[path.stem].domain
        if dataset.line == "rig":  # recordings: few samples
            continue
        size = config["sst"]["size"]
        shape = (
            (size, size) if domain == "image" else (config["windows"]["samples_per_revolution"],)
        )
        channels = CHANNELS[dataset.signal]
        step, prediction = operations(build(path.stem, channels), torch.zeros(1, channels, *shape))
        samples = len(CLASSES) * per_class[domain]
        samples *= per_class["randomised"] if dataset.randomised == "yes" else 1
        epochs = sum(len(history["validation_loss"]) for history in json.loads(path.read_text()))
        total += epochs * samples * (FIT_SHARE * step + (1 - FIT_SHARE) * prediction)
    return total


def bound_sentences(results: Path, seconds: pd.DataFrame, wall_s: float, cores: int) -> list[str]:
    """What bounds a run whose jobs took `wall_s` in all: its trainings, and their products."""
    bfloat16 = multiplies_bfloat16()
    rate = machine.product_rate(bfloat16)
    trained = seconds.sum().sum()
    least = operations_of_run(results) / rate
    return [
        f"Trainings take {100 * trained / wall_s:.0f} % of the default run's job seconds; the rest "
        f"alone takes {(wall_s - trained) / cores / 60:.0f} min of {cores} cores.",
        f"At the rate of large {'bfloat16' if bfloat16 else 'float32'} products, the convolutions "
        f"of all trainings on simulated samples would take {least / cores / 60:.0f} min of {cores} "
        f"cores, {100 * least / trained:.0f} % of what all trainings take.",
    ]


def _text(seconds: float) -> str:
    return "–" if pd.isna(seconds) else f"{seconds:.0f}"
