"""Whether networks are as accurate when they train in mixed precision.

    for each in float32 bfloat16; do
        snakemake --cores 2 accuracy_table --config results=results/$each \\
            "training={precision: $each}"
    done
    python benchmarks/precision.py results/float32 results/bfloat16

Prints, for each network and dataset of two finished runs, the mean accuracy over seeds in per cent
with either severity, the difference with its 95 % interval (Welch 1947), and the mean epochs.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import pandas as pd

from rippletwin.learning.architectures import ARCHITECTURES
from rippletwin.learning.markdown import markdown_table
from rippletwin.learning.paper_claims import paired_difference

SCORE = "accuracy_either"  # per cent
CELL = ["architecture", "dataset"]


def compare(one: pd.DataFrame, other: pd.DataFrame) -> list[list[str]]:
    """Rows of the table: network, dataset, both accuracies and their difference in per cent, and
    the epochs that both took."""
    tables = [dict(list(run.groupby(CELL, sort=False))) for run in (one, other)]
    rows = []
    for cell in (cell for cell in tables[0] if cell in tables[1]):
        pair = [table[cell] for table in tables]
        scores = [each[SCORE].agg(["mean", "std", "count"]) for each in pair]
        change, low, high = paired_difference(*(score.tolist() for score in reversed(scores)))
        rows.append(
            [
                ARCHITECTURES[cell[0]].title,
                cell[1],
                *(f"{score['mean']:.1f}" for score in scores),
                f"{change:+.1f} ({low:+.1f} to {high:+.1f})",
                *(f"{each.epochs.mean():.1f}" for each in pair),
            ]
        )
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("runs", nargs=2, type=Path, help="results folders of two finished runs")
    runs = parser.parse_args().runs
    tables = [pd.read_csv(run / "accuracy.csv") for run in runs]
    names = [run.name for run in runs]
    header = ["network", "dataset", *names, "difference", *(f"epochs, {name}" for name in names)]
    print(markdown_table(header, compare(*tables)))


if __name__ == "__main__":
    main()
