"""A page on what the left-out physics cost: accuracy with the calibrated and the corrected twin."""

import json
from pathlib import Path

import pandas as pd

from job import open_log
from rippletwin import store
from rippletwin.learning.tables import cost_table
from rippletwin.twin.twin_file import load_twin

report_progress = open_log(snakemake)
results = pd.read_csv(snakemake.input.table)
verdict = json.loads(Path(snakemake.input.verdict).read_text())
effects = load_twin(snakemake.input.twin, snakemake.input.effects).effects
taken_in = [f"{effect.name.replace('_', ' ')} ({place})" for effect, place in effects]
store.write_text(
    snakemake.output[0],
    f"""# What the left-out physics cost

The verdict of `explain` is `{verdict["verdict"]}`; the corrected twin, that of the columns with a
plus, has besides the paper's physics: {", ".join(taken_in) or "nothing"}. Misfit of healthy
recordings left out of its fit: {verdict["fit"]["before"]["held_out"]:.1%} before,
{verdict["fit"]["after"]["held_out"]:.1%} after.

Accuracy on recordings in per cent, mean and standard deviation over seeds: with the calibrated
twin, with the corrected one, and the difference, which is the cost.

{cost_table(results, snakemake.params.pairs)}
## Either severity of a cylinder fault counts as right

{cost_table(results, snakemake.params.pairs, "accuracy_either")}""",
)
report_progress(f"{len(taken_in)} effects taken in")
