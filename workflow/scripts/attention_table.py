"""Alignment of every network beside its accuracy, and how the one ranks the other."""

import pandas as pd

from job import open_log
from rippletwin import store
from rippletwin.learning.alignment_ranking import alignment_table, rank_table, ranking_markdown
from rippletwin.learning.architectures import ARCHITECTURES

report_progress = open_log(snakemake)
shares = []
for (dataset, architecture), path in zip(
    snakemake.params.cells, snakemake.input.attention, strict=True
):
    cell = store.load(path)[["attended", "region", "blind"]].to_dataframe().reset_index()
    domain = ARCHITECTURES[architecture].domain
    shares.append(cell.assign(dataset=dataset, architecture=architecture, domain=domain))
table = alignment_table(pd.concat(shares), pd.read_csv(snakemake.input.table))
ranks = rank_table(table)
store.write_table(snakemake.output.table, table)
store.write_table(snakemake.output.ranks, ranks)
store.write_text(snakemake.output.page, ranking_markdown(table, ranks))
report_progress(f"{len(table)} networks, {len(ranks)} rank correlations")
