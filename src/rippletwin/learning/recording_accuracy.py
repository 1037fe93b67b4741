"""Accuracy with the recording as the unit: windows of one recording are no independent samples.

A recording is right where most of its windows are, either severity of a cylinder fault counting as
right. The interval of a share of recordings is exact (Clopper & Pearson 1934, Biometrika 26, 404).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
import pandas as pd
from scipy.stats import binomtest

from rippletwin.learning.architectures import ARCHITECTURES, CLASSES
from rippletwin.learning.dataset import UNKNOWN
from rippletwin.learning.footnote import mark_unconverged, with_footnote
from rippletwin.learning.markdown import markdown_table

CELL = ["architecture", "dataset"]
MOST_SUBSETS = 2**14  # of differences whose means are taken


def recording_rows(answers: pd.DataFrame) -> pd.DataFrame:
    """A row a seed and recording of known state, from a row a seed and window.

    answers : columns seed, recording, truth and predicted (of ``CLASSES``).
    Columns seed, recording, truth, windows; share of the windows that are right; whether most are,
    ``right``; and the share that says each class, ``said_H`` and so on.
    """
    known = answers[answers.truth != UNKNOWN]
    said = {f"said_{name}": known.predicted == name for name in CLASSES}
    kind = known.truth.str[0] == known.predicted.str[0]
    rows = known.assign(share=kind, windows=1, **said)
    columns = {"windows": "sum", "share": "mean"} | dict.fromkeys(said, "mean")
    table = rows.groupby(["seed", "recording", "truth"], sort=False).agg(columns).reset_index()
    return table.assign(right=table.share > 0.5)


def exact_interval(right: int, count: int) -> tuple[float, float]:
    """95 % interval of a probability of which `right` of `count` trials came true."""
    interval = binomtest(right, count).proportion_ci(0.95, "exact")
    return float(interval.low), float(interval.high)


def recording_cells(rows: pd.DataFrame) -> pd.DataFrame:
    """A row a network and dataset: mean and standard deviation over seeds of the share of
    recordings that are right, per cent; and the recordings that all seeds' windows together get
    right, with their number and the 95 % interval of the share, per cent.

    rows : ``recording_rows`` with columns architecture and dataset.
    """
    table = []
    for (architecture, dataset), cell in rows.groupby(CELL, sort=False):
        shares = 100.0 * cell.groupby("seed").right.mean()
        together = cell.groupby("recording").share.mean() > 0.5
        low, high = exact_interval(int(together.sum()), len(together))
        table.append(
            {
                "architecture": architecture,
                "dataset": dataset,
                "mean": shares.mean(),
                "std": shares.std() if len(shares) > 1 else 0.0,
                "right": int(together.sum()),
                "recordings": len(together),
                "low": 100.0 * low,
                "high": 100.0 * high,
            }
        )
    return pd.DataFrame(table)


def recording_shares(rows: pd.DataFrame) -> pd.DataFrame:
    """Share of the windows that are right, per cent, the mean over seeds: a row a recording, a
    column a cell (architecture, dataset), NaN where the cell lacks the recording.

    rows : ``recording_rows`` with columns architecture and dataset.
    """
    shares = rows.groupby(["recording", *CELL], sort=False).share.mean()
    return 100.0 * shares.unstack(CELL)


def paired_interval(differences: np.ndarray) -> tuple[float, float]:
    """95 % interval of the mean of recordings of which these (R,) were drawn; NaN for five or less.

    The means of all subsets of the differences part the line, and the mean lies in each part with
    equal probability where differences are symmetric about it (Hartigan 1969, J. Am. Stat. Assoc.
    64, 1303). So no spread of a few equal differences is taken for certainty.
    """
    count = len(differences)
    if 2**count <= MOST_SUBSETS:
        chosen = np.arange(1, 2**count)[:, None] >> np.arange(count) & 1
    else:
        chosen = np.random.default_rng(0).integers(0, 2, (MOST_SUBSETS - 1, count))
    means = np.sort((chosen @ differences) / np.maximum(chosen.sum(axis=1), 1))
    tail = int(0.025 * (len(means) + 1))
    if not tail:
        return float("nan"), float("nan")
    low, high = means[[tail - 1, -tail]].round(9) + 0.0  # equal differences add up to zero
    return float(low), float(high)


def recording_table(
    rows: pd.DataFrame, datasets: Sequence[str], unconverged: Collection[tuple[str, str]] = ()
) -> str:
    """Markdown of ``recording_cells``, a row a network and a column for each of `datasets`.

    unconverged : (architecture, dataset) of cells to mark, with a footnote: not all of their
    trainings converged.
    """
    cells = {
        (c.architecture, c.dataset): mark_unconverged(
            f"{c.mean:.0f} ± {c.std:.0f} ({c.right} of {c.recordings}, "
            f"{c.low:.0f} to {c.high:.0f})",
            (c.architecture, c.dataset) not in unconverged,
        )
        for c in recording_cells(rows).itertuples()
    }
    named = [name for name in ARCHITECTURES if name in set(rows.architecture)]
    lines = [[ARCHITECTURES[name].title, *(cells.get((name, d), "–") for d in datasets)]
             for name in named]  # fmt: skip
    return with_footnote(markdown_table(["Architecture", *datasets], lines))


def severity_table(rows: pd.DataFrame, datasets: Sequence[str], names: Sequence[str]) -> str:
    """Markdown of what is said of each recording: for each dataset the share of windows that are
    right and, of a cylinder fault, the share called C2, per cent over networks and seeds.

    names : the recordings' names by their number in `rows`.
    """
    lines = []
    for (recording, truth), of_one in rows.groupby(["recording", "truth"], sort=True):
        line = [names[recording], truth]
        for dataset in datasets:
            seen = of_one[of_one.dataset == dataset]
            text = f"{100 * seen.share.mean():.0f}" if len(seen) else "–"
            if truth.startswith("C") and len(seen):
                text += f" ({100 * seen.said_C2.mean():.0f})"
            line.append(text)
        lines.append(line)
    return markdown_table(["Recording", "state", *datasets], lines)
