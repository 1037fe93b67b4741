"""A page on compound faults: how often networks that know single faults call them what."""

import pandas as pd

from job import open_log
from rippletwin import store
from rippletwin.learning.tables import answer_table

report_progress = open_log(snakemake)
answers = pd.concat(
    pd.read_csv(path).assign(dataset=dataset, architecture=architecture)
    for (dataset, architecture), path in zip(
        snakemake.params.cells, snakemake.input.answers, strict=True
    )
)
store.write_text(
    snakemake.output[0],
    f"""# Faults that come together

Simulated with the leaks of the single faults, both from the same piston on, and shown to networks
that learnt single faults only. Shares of the answers over samples and seeds, per cent.

{answer_table(answers)}""",
)
report_progress(
    f"{answers.recording.nunique()} compound faults, {len(snakemake.params.cells)} networks"
)
