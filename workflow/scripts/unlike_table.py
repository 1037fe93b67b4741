"""How many recorded windows each network calls unlike everything simulated."""

import pandas as pd

from job import open_log
from rippletwin import store
from rippletwin.learning.architectures import ARCHITECTURES
from rippletwin.learning.conformal import PROMISED_RATE
from rippletwin.learning.markdown import markdown_table

report_progress = open_log(snakemake)
names = store.load(snakemake.input.recorded).labels
cells = pd.concat(
    pd.read_csv(path).assign(network=f"{dataset}, {ARCHITECTURES[architecture].title}")
    for (dataset, architecture), path in zip(
        snakemake.params.cells, snakemake.input.rates, strict=True
    )
)
table = 100 * cells.pivot_table(index="network", columns="recording", values="unlike", sort=False)
table.columns = [names[k] for k in table.columns]
lines = [[network, *(f"{share:.0f}" for share in row)] for network, *row in table.itertuples()]
store.write_text(
    snakemake.output.page,
    f"""# Windows that are unlike everything simulated

Share of the windows of each recording that networks call unlike, per cent over seeds. Of simulated
windows at most {100 * PROMISED_RATE:.0f} % are called so; their conformal p-values promise it.

"""
    + markdown_table(["Network", *table.columns], lines),
)
report_progress(f"{len(table)} networks")
