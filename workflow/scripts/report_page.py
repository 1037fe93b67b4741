"""One page with the case, its verdict, its diagnosis, and what the whole run has found."""

import json
from base64 import b64encode
from pathlib import Path

import pandas as pd
import yaml

from diagnosis_trial.population_charts import chart_population
from job import open_log
from rippletwin.learning.accuracy import summarise
from rippletwin.learning.architectures import ARCHITECTURES
from rippletwin.report.content import WorkflowPart
from rippletwin.report.page import write_report
from rippletwin.report.results import read_results
from rippletwin.report.workflow_tables import (
    accuracy_table,
    answer_table,
    describe_attention,
    timing_table,
)

report_progress = open_log(snakemake)
params, paths = snakemake.params, snakemake.input
rows = summarise(pd.read_csv(paths.table)).to_dict("records") if paths.table else []
for row in rows:
    row["title"] = ARCHITECTURES[row["architecture"]].title
paper = pd.read_csv(paths.paper).itertuples(index=False)
pictures = []
for path in map(Path, paths.attention):
    windows = path.stem.rpartition("_")[2]
    picture = "data:image/png;base64," + b64encode(path.read_bytes()).decode()
    pictures.append((describe_attention(windows), picture))
theirs = {(p.architecture, p.dataset): (p.mean, p.std) for p in paper}
answers = json.loads(Path(paths.answers).read_text()) if paths.answers else {}
tables = [
    *([answer_table(answers)] if answers else []),
    *([accuracy_table(rows, theirs, params.datasets)] if rows else []),
    timing_table(params.benchmarks),
]
population = None
if params.population:
    population = chart_population(json.loads(Path(params.population[0]).read_text()))
workflow = WorkflowPart(
    tables=tables,
    pictures=pictures,
    notes=[f"The recordings are {params.recordings}."],
    configuration=yaml.safe_dump(params.configuration, sort_keys=False),
    population=population,
)
results = read_results(
    Path(paths.rig).parent,
    Path(paths.verdict).parent,
    Path(paths.diagnosis[0]).parent if paths.diagnosis else None,
)
write_report(results, snakemake.output[0], workflow)
report_progress(f"{len(rows)} accuracies, {len(results.missing)} things missing")
