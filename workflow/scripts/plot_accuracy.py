"""Accuracy of every network on every dataset, beside the paper's."""

import pandas as pd

from job import open_log
from rippletwin.figures import diagnosis
from rippletwin.figures.style import save
from rippletwin.learning.accuracy import summarise
from rippletwin.learning.architectures import ARCHITECTURES

report_progress = open_log(snakemake)
ours = summarise(pd.read_csv(snakemake.input.table))
paper = pd.read_csv(snakemake.input.paper)
names = [name for name in ARCHITECTURES if name in set(ours.architecture)]


def cells(table):
    """dataset -> (A, 2) mean and standard deviation."""
    return {
        dataset: rows.set_index("architecture").reindex(names)[["mean", "std"]].to_numpy()
        for dataset, rows in table.groupby("dataset", sort=False)
    }


titles = [ARCHITECTURES[name].title for name in names]
save(diagnosis.plot_accuracy(titles, cells(ours), cells(paper)), *snakemake.output)
report_progress(f"{len(names)} networks")
