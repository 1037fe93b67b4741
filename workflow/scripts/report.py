"""Every training's accuracy as a tidy table, and as the paper's table beside the paper's."""

import json
from pathlib import Path

import pandas as pd

from job import start
from rippletwin.accuracy import accuracy_table, result_row, score
from rippletwin.networks import CLASSES
from rippletwin.training import History

tell = start(snakemake)
params, paths = snakemake.params, snakemake.input
rows = []
for (dataset, architecture), predictions, histories in zip(
    params.cells, paths.predictions, paths.histories, strict=True
):
    signal = "flow" if dataset.startswith("CFD-Q") else "pressure"
    endings = [History(**h) for h in json.loads(Path(histories).read_text())]
    for seed, windows in pd.read_csv(predictions).groupby("seed"):
        predicted = windows.predicted.map(CLASSES.index).to_numpy()
        scored = score(windows.truth.to_numpy(), predicted, signal, params.severity)
        rows.append(result_row(architecture, dataset, seed, scored, endings[seed]))
results = pd.DataFrame(rows)
results.to_csv(snakemake.output.table, index=False)
paper = pd.read_csv(paths.paper)
Path(snakemake.output.page).write_text(
    f"""# Diagnostic accuracy on recordings, per cent

The recordings are {params.recordings}; mean and standard deviation over {len(endings)} seeds, the
paper's values in brackets. A recorded cylinder fault is right as {params.severity["pressure"]} for
pressure and as {params.severity["flow"]} for flow.

{accuracy_table(results, paper)}
## Either severity of a cylinder fault counts as right

{accuracy_table(results, paper.iloc[:0].assign(dataset=[]), "accuracy_either")}
{int(results.converged.sum())} of {len(results)} trainings met the convergence rule.
"""
)
tell(f"{len(results)} trainings, {int(results.converged.sum())} of them converged")
