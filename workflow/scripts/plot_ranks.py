"""Accuracy on recordings against alignment on simulations."""

import pandas as pd

from job import open_log
from rippletwin.figures import attention
from rippletwin.figures.style import save
from rippletwin.learning.architectures import ARCHITECTURES

report_progress = open_log(snakemake)
table = pd.read_csv(snakemake.input.table).fillna({"accuracy_std": 0, "alignment_std": 0})
groups = {
    dataset: (
        [ARCHITECTURES[name].title for name in rows.architecture],
        (rows.domain == "image").to_numpy(),
        rows[["alignment", "alignment_std"]].to_numpy(),
        rows[["accuracy", "accuracy_std"]].to_numpy(),
    )
    for dataset, rows in table.groupby("dataset", sort=False)
}
save(attention.plot_ranks(groups), snakemake.output.png, snakemake.output.svg)
report_progress(f"{len(groups)} datasets")
