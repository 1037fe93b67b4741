"""Accuracy over all recordings at the diagnosed operating point, the recording being the unit."""

import pandas as pd

from job import open_log
from rippletwin import store
from rippletwin.learning.accuracy import summarise
from rippletwin.learning.recording_accuracy import recording_rows, recording_table, severity_table

report_progress = open_log(snakemake)
params, paths = snakemake.params, snakemake.input
ended = summarise(pd.read_csv(paths.accuracy))
missed = ended[~ended.converged]
unconverged = set(zip(missed.architecture, missed.dataset, strict=True))
names = store.load(paths.recorded).labels
rows = pd.concat(
    recording_rows(pd.read_csv(path)).assign(architecture=architecture, dataset=dataset)
    for (dataset, architecture), path in zip(params.cells, paths.predictions, strict=True)
)
named = rows.assign(recording=rows.recording.map(dict(enumerate(names))))
store.write_table(snakemake.output.table, named)
page = "# Accuracy over recordings\n\nNo recording is of known state.\n"
if len(rows):
    page = f"""# Accuracy over recordings

All {rows.recording.nunique()} recordings of known state at the diagnosed operating point. The
recording is the unit: it is right where most of its windows are, either severity of a cylinder
fault being right. Per cent of the recordings, mean and standard deviation over seeds; in brackets
the recordings that are right by all seeds' windows together, and the share's exact 95 % interval.

{recording_table(rows, params.datasets, unconverged)}
## By recording

Windows that are right, per cent over networks and seeds; in brackets those called C2.

{severity_table(rows, params.datasets, names)}"""
store.write_text(snakemake.output.page, page)
report_progress(f"{rows.recording.nunique()} recordings")
