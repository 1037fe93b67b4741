"""Every training's accuracy as a tidy table, and as the paper's table beside the paper's."""

import json
from pathlib import Path

import pandas as pd

from job import open_log
from rippletwin import store
from rippletwin.learning.accuracy import result_row, score
from rippletwin.learning.architectures import CLASSES
from rippletwin.learning.tables import accuracy_table
from rippletwin.learning.training import History
from rippletwin.learning.windows import first_of_each_state

report_progress = open_log(snakemake)
params, paths = snakemake.params, snakemake.input
rows, arithmetics = [], set()
for (dataset, architecture), predictions, histories in zip(
    params.cells, paths.predictions, paths.histories, strict=True
):
    endings = [History(**h) for h in json.loads(Path(histories).read_text())]
    arithmetics |= {ending.arithmetic for ending in endings}
    answers = pd.read_csv(predictions)
    severity = None if dataset in params.randomised else params.severity
    protocol = answers[first_of_each_state(answers.truth, answers.recording)]
    for seed, windows in protocol.groupby("seed"):
        predicted = windows.predicted.map(CLASSES.index).to_numpy()
        scored = score(windows.truth.to_numpy(), predicted, params.signals[dataset], severity)
        rows.append(result_row(architecture, dataset, seed, scored, endings[seed]))
results = pd.DataFrame(rows)
store.write_table(snakemake.output.table, results)
paper = pd.read_csv(paths.paper)
page = f"""# Diagnostic accuracy on recordings, per cent

The recordings are {params.recordings}, of each state the first; mean and standard deviation over
{len(endings)} seeds, the paper's values in brackets. A cylinder fault is right as
{params.severity["pressure"]} for pressure and {params.severity["flow"]} for flow; as either, where
networks learnt a range of severities. Networks of `experimental` and of randomised datasets are
tested on the late windows of these recordings alone.

{accuracy_table(results, paper, params.columns)}
## Either severity of a cylinder fault counts as right

{accuracy_table(results, paper.iloc[:0], params.columns, "accuracy_either")}
{int(results.converged.sum())} of {len(results)} trainings met the convergence rule.
Products were {" or ".join(sorted(arithmetics))}.
"""
store.write_text(snakemake.output.page, page)
report_progress(f"{len(results)} trainings, {int(results.converged.sum())} of them converged")
