"""The page and the figures of a diagnosis trial."""

import json
from pathlib import Path

from diagnosis_trial.figures import draw_figures
from diagnosis_trial.page import report_page
from job import open_log
from rippletwin import store

report_progress = open_log(snakemake)
rows = json.loads(Path(snakemake.input.rows).read_text())
origin = {name: snakemake.params[name] for name in ("commit", "number", "not_committed")}
draw_figures(rows, snakemake.output.figures)
store.write_text(snakemake.output.page, report_page(rows, origin))
report_progress(f"{snakemake.output.page} written")
