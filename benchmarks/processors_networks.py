"""How much trained networks depend on the processor: the same training again, and on another.

    python benchmarks/processors_networks.py

The workflow trains ten seeds of the smoke run's networks on one dataset: as it is, a second time,
and while torch works as on any processor with SSE4, without AVX. Rounding differs then, and
training carries the difference on. Prints how many of the recorded windows get another class from
the network of the same seed, and by how much the mean accuracy over seeds moves at most, beside its
standard deviation over seeds.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import pandas as pd
from pandas.api.typing import SeriesGroupBy

VARIANTS = {
    "the same again": {},
    "torch as without AVX": {
        "ATEN_CPU_CAPABILITY": "default",
        "ONEDNN_MAX_CPU_ISA": "SSE41",
        "MKL_ENABLE_INSTRUCTIONS": "SSE4_2",
    },
}
CONFIG = ("datasets=[CFD-MOC-P]", "seeds=10")
ROOT = Path(__file__).resolve().parents[1]


def run_workflow(out: Path, variables: dict[str, str]) -> Path:
    """The results of a run with these environment variables."""
    command = [sys.executable, "-m", "snakemake", f"{out}/accuracy.csv", "--cores", "2"]
    command += ["--configfile", "config/smoke.yaml", "--config", f"results={out}", *CONFIG]
    subprocess.run(command, check=True, cwd=ROOT, env=os.environ | variables)
    return out


def changed_windows(one: Path, other: Path) -> tuple[int, int]:
    """Windows that get another class, and of how many: over networks, datasets and seeds."""
    changed = total = 0
    for path in sorted((one / "predictions").rglob("*.csv")):
        here, there = (pd.read_csv(p).predicted for p in (path, other / path.relative_to(one)))
        changed, total = changed + int((here != there).sum()), total + len(here)
    return changed, total


def accuracies(results: Path) -> SeriesGroupBy:
    """Accuracy, per cent, of each network on each dataset, a value each seed."""
    return pd.read_csv(results / "accuracy.csv").groupby(["dataset", "architecture"]).accuracy


def main() -> None:
    argparse.ArgumentParser(description=__doc__.split("\n\n")[0]).parse_args()
    lines = ["| libraries | windows of another class | accuracy moves by | deviation over seeds |"]
    lines.append("|---|---|---|---|")
    with TemporaryDirectory() as folder:
        first = run_workflow(Path(folder) / "first", {})
        before = accuracies(first)
        for k, (name, variables) in enumerate(VARIANTS.items()):
            again = run_workflow(Path(folder) / str(k), variables)
            changed, total = changed_windows(first, again)
            moved = (accuracies(again).mean() - before.mean()).abs().max()
            row = f"{changed} of {total} | {moved:.1f} % | {before.std().mean():.1f} %"
            lines.append(f"| {name} | {row} |")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
