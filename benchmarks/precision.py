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

import numpy as np
import pandas as pd
from scipy import stats

from rippletwin.learning.architectures import ARCHITECTURES
from rippletwin.learning.markdown import markdown_table

SCORE = "accuracy_either"  # per cent


def difference(one: np.ndarray, other: np.ndarray) -> tuple[float, float]:
    """Mean of `other` less that of `one`, and half the width of its 95 % interval, for values
    (seeds,)."""
    change = float(other.mean() - one.mean())
    if one.std() == other.std() == 0:
        return change, 0.0
    low, high = stats.ttest_ind(other, one, equal_var=False).confidence_interval(0.95)
    return change, float(high - low) / 2


def compare(one: pd.DataFrame, other: pd.DataFrame) -> list[list[str]]:
    """Rows of the table: network, dataset, both accuracies and their difference in per cent, and
    the epochs that both took."""
    cells = ["architecture", "dataset"]
    second = dict(list(other.groupby(cells)))
    rows = []
    for cell, first in one.groupby(cells, sort=False):
        if cell not in second:
            continue
        pair = (first, second[cell])
        change, width = difference(*(each[SCORE].to_numpy() for each in pair))
        rows.append(
            [
                ARCHITECTURES[cell[0]].title,
                cell[1],
                *(f"{each[SCORE].mean():.1f}" for each in pair),
                f"{change:+.1f} ± {width:.1f}",
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
