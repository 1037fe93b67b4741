"""How much trained networks depend on the processor: one run of the workflow, and another.

    python benchmarks/processors_networks.py [--config config/smoke.yaml]

The workflow runs twice as it is, and once while torch works as on any processor with SSE4, without
AVX. Rounding differs then, and training carries the difference on. Prints how many of the recorded
windows get another class from the network of the same seed, and by how much the accuracies of
networks on datasets move, beside the standard deviation over seeds.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd

VARIANTS = {
    "the same again": {},
    "torch as without AVX": {
        "ATEN_CPU_CAPABILITY": "default",
        "ONEDNN_MAX_CPU_ISA": "SSE41",
        "MKL_ENABLE_INSTRUCTIONS": "SSE4_2",
    },
}
CELL = ["dataset", "architecture"]


def run_workflow(config: Path, out: Path, variables: dict[str, str]) -> Path:
    """The results of a run with these environment variables."""
    command = [sys.executable, "-m", "snakemake", "--cores", "2", "--configfile", str(config)]
    command += ["--config", f"results={out}"]
    subprocess.run(command, check=True, capture_output=True, env=os.environ | variables)
    return out


def changed_windows(one: Path, other: Path) -> tuple[int, int]:
    """Windows that get another class, and of how many: over networks, datasets and seeds."""
    changed = total = 0
    for path in sorted((one / "predictions").rglob("*.csv")):
        here, there = (pd.read_csv(p).predicted for p in (path, other / path.relative_to(one)))
        changed, total = changed + int((here != there).sum()), total + len(here)
    return changed, total


def moved_accuracies(one: Path, other: Path) -> np.ndarray:
    """By how much the accuracy of each network on each dataset moves, a share: mean over seeds."""
    here, there = (pd.read_csv(p / "accuracy.csv").groupby(CELL).accuracy for p in (one, other))
    return (here.mean() - there.mean()).abs().to_numpy()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--config", type=Path, default=Path("config/smoke.yaml"))
    options = parser.parse_args()
    print("| libraries | windows of another class | an accuracy moves by | largest | over seeds |")
    print("|---|---|---|---|---|")
    with TemporaryDirectory() as folder:
        first = run_workflow(options.config, Path(folder) / "first", {})
        seeds = pd.read_csv(first / "accuracy.csv").groupby(CELL).accuracy.std().mean()
        for k, (name, variables) in enumerate(VARIANTS.items()):
            again = run_workflow(options.config, Path(folder) / str(k), variables)
            changed, total = changed_windows(first, again)
            moved = moved_accuracies(first, again)
            print(
                f"| {name} | {changed} of {total} | {moved.mean():.1%} (mean) | {moved.max():.1%} "
                f"| {seeds:.1%} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
