"""The page and the figures of a concealed trial."""

import json
from pathlib import Path

from concealed.figures import draw_figures
from concealed.page import report_page
from job import open_log
from rippletwin import store

report_progress = open_log(snakemake)
rows = json.loads(Path(snakemake.input.rows).read_text())
origin = {
    "commit": snakemake.params.commit,
    "number": snakemake.params.number,
    "not_committed": snakemake.params.not_committed,
    "checks": json.loads(Path(snakemake.input.numerics[0]).read_text()),
}
draw_figures(rows, snakemake.output.figures)
store.write_text(snakemake.output.page, report_page(rows, origin))
report_progress(f"{snakemake.output.page} written")
