"""The paper's claims, judged on our accuracies with one severity, as the paper has it."""

from pathlib import Path

import pandas as pd

from job import open_log
from rippletwin import store
from rippletwin.case.load import load_case
from rippletwin.figures import attention
from rippletwin.figures.style import save
from rippletwin.learning import paper_claims
from rippletwin.learning.recording_accuracy import recording_shares

report_progress = open_log(snakemake)
paths = snakemake.output
pistons = load_case(Path(snakemake.input.rig).parent, states=()).rig.pump["pistons"]
results = pd.read_csv(snakemake.input.table)
# a recording's label is text, whatever it looks like: 01 or None
recordings = pd.read_csv(
    snakemake.input.recordings, dtype={"recording": str}, keep_default_na=False
)
results, recordings = (
    table[table.dataset.isin(snakemake.params.datasets)] for table in (results, recordings)
)
shares = recording_shares(recordings)
cells = paper_claims.cells_of(results, pd.read_csv(snakemake.input.paper), shares)
compared = paper_claims.compare_cells(cells, shares)
judged = paper_claims.judge_claims(
    compared, cells, snakemake.params.samples_per_revolution / pistons
)
store.write_table(paths.table, judged)
store.write_table(paths.comparisons, compared)
store.write_text(paths.page, paper_claims.claims_markdown(judged, compared))

groups = {
    claim.split(":")[0]: (
        [
            f"{row.dataset}: {row.better} − {row.worse}"
            if claim != paper_claims.CALIBRATION
            else f"{row.better}: {row.dataset} − {row.worse}"
            for row in rows.itertuples()
        ],
        rows[["difference", "low", "high"]].to_numpy(),
    )
    for claim, rows in compared[compared.score == paper_claims.RECORDINGS].groupby(
        "claim", sort=False
    )
}
save(attention.plot_claims(groups), paths.png, paths.svg)
report_progress(f"{len(compared)} comparisons")
