"""Confusion matrices of one dataset, a panel a network, all seeds together."""

import pandas as pd

from job import open_log
from rippletwin.figures import diagnosis
from rippletwin.figures.style import save
from rippletwin.learning.accuracy import CLASSES, TRUE_STATES, confusion_of
from rippletwin.learning.architectures import ARCHITECTURES

report_progress = open_log(snakemake)
results = pd.read_csv(snakemake.input.table)
rows = results[results.dataset == snakemake.wildcards.dataset]
matrices = {}
for architecture, trainings in rows.groupby("architecture", sort=False):
    counts = confusion_of(trainings)
    matrices[ARCHITECTURES[architecture].title] = counts / counts.sum(1, keepdims=True).clip(1)
save(diagnosis.plot_confusion(matrices, TRUE_STATES, CLASSES), *snakemake.output)
report_progress(f"{len(matrices)} matrices")
