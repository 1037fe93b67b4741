"""Accuracy tables beside the paper's."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from rippletwin.learning.accuracy import summarise
from rippletwin.learning.architectures import ARCHITECTURES, CLASSES
from rippletwin.learning.footnote import mark_unconverged, with_footnote
from rippletwin.learning.markdown import markdown_table

DOMAIN_TITLES = {"time": "Time domain", "image": "Time-frequency domain"}


def accuracy_table(
    rows: pd.DataFrame,
    paper: pd.DataFrame,
    datasets: Sequence[str],
    column: str = "accuracy",
) -> str:
    """The paper's table in markdown: ours, with the paper's mean and deviation in brackets.

    rows : tidy results (``result_row``); paper : columns architecture, dataset, mean, std;
    datasets : names of the columns from left to right, of which those are shown that either has.
    A cell that was not run, or cannot be scored, is a dash; one whose trainings did not all
    converge is marked, with a footnote.
    """
    ours, theirs = _cells(summarise(rows, column)), _cells(paper)
    known = {*paper["dataset"], *rows["dataset"]}
    datasets = [dataset for dataset in datasets if dataset in known]

    lines = []
    domain = None
    for name, architecture in ARCHITECTURES.items():
        first = DOMAIN_TITLES[architecture.domain] if architecture.domain != domain else ""
        domain = architecture.domain
        cells = []
        for dataset in datasets:
            cell = ours.get((name, dataset), "–")
            if (name, dataset) in theirs:
                cell += f" ({theirs[name, dataset]})"
            cells.append(cell)
        lines.append((first, architecture.title, *cells))
    return with_footnote(markdown_table(["Input", "Architecture", *datasets], lines))


def cost_table(
    rows: pd.DataFrame, pairs: Sequence[tuple[str, str]], column: str = "accuracy"
) -> str:
    """Markdown of the cost of missing physics: each dataset beside the corrected twin's.

    rows : tidy results (``result_row``); pairs : (dataset of the calibrated twin, the same of the
    corrected one). A line a network, and one for the mean of those networks that ran on both; the
    cost is accuracy with the corrected twin less that with the calibrated, in per cent of all
    windows. A cell that was not run is a dash; one that did not converge is marked.
    """
    table = summarise(rows, column)
    cells, means = _cells(table), table.set_index(["architecture", "dataset"])["mean"]
    ran = [name for name in ARCHITECTURES if name in set(rows["architecture"])]
    head = [title for without, plus in pairs for title in (without, plus, "cost")]
    lines = []
    for name in ran:
        line = []
        for pair in pairs:
            without, plus = (means.get((name, dataset), np.nan) for dataset in pair)
            cost = "–" if np.isnan(plus - without) else f"{plus - without:+.1f}"
            line += [*(cells.get((name, dataset), "–") for dataset in pair), cost]
        lines.append((ARCHITECTURES[name].title, *line))
    line = []
    for pair in pairs:
        both = pd.DataFrame({d: means.xs(d, level="dataset") for d in pair}).dropna()
        without, plus = (both[dataset].mean() for dataset in pair)
        numbers = f"{without:.1f}", f"{plus:.1f}", f"{plus - without:+.1f}"
        line += numbers if len(both) else ["–"] * 3
    lines.append(("mean of networks", *line))
    return with_footnote(markdown_table(["Architecture", *head], lines))


def answer_table(answers: pd.DataFrame) -> str:
    """Markdown of the predicted classes of signals that are not scored: shares in per cent.

    answers : columns recording, dataset, architecture and predicted (of ``CLASSES``), a row a
    window and seed.
    """
    lines = []
    for keys, said in answers.groupby(["recording", "dataset", "architecture"], sort=False):
        recording, dataset, architecture = keys
        share = [f"{100 * (said['predicted'] == name).mean():.0f}" for name in CLASSES]
        cells = [str(recording), dataset, ARCHITECTURES[architecture].title, str(len(said))]
        lines.append([*cells, *share])
    return markdown_table(["Recording", "Dataset", "Architecture", "windows", *CLASSES], lines)


def _cells(table: pd.DataFrame) -> dict[tuple[str, str], str]:
    return {
        (cell.architecture, cell.dataset): mark_unconverged(
            f"{cell.mean:.1f} ± {cell.std:.1f}", getattr(cell, "converged", True)
        )
        for cell in table.itertuples()
        if not np.isnan(cell.mean)
    }
