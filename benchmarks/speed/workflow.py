"""Where the time of a run of the workflow goes, by rule, from the run's own benchmark files."""

from __future__ import annotations

import os
from pathlib import Path

from run_costs import costs
from speed.result import Claim, Result, Table

RUN = "RIPPLETWIN_BENCH_RUN"
"""Environment variable: the results folder of a finished run."""
TARGET_MINUTES, CORES = 100.0, 2  # of the default run, without bfloat16


def run(quick: bool = False) -> Result:
    """The table of a finished run, where one is named."""
    folder = os.environ.get(RUN)
    title, what = "The workflow", ["Wall seconds of each rule, summed over its jobs."]
    whole = "default run, images of 64 pixels, two cores"
    if not folder or not any(Path(folder, "benchmarks").rglob("*.tsv")):
        return Result(
            6,
            title,
            what,
            [Claim(whole, None, TARGET_MINUTES, "min", at_least=False)],
            notes=[f"Not measured: no finished run was named in {RUN}."],
        )
    table = costs(Path(folder))
    total = float(table.wall_s.sum())
    rows = [
        [rule, int(row.jobs), f"{row.wall_s:.0f}", f"{row.cpu_s:.0f}", f"{row.peak_mb:.0f}"]
        for rule, row in table.iterrows()
    ]
    return Result(
        6,
        title,
        what,
        [
            Claim(
                f"jobs of the run in {Path(folder).name}, on {CORES} cores",
                total / 60 / CORES,
                None,
                "min",
                at_least=False,
            ),
            Claim(whole, None, TARGET_MINUTES, "min", at_least=False),
        ],
        [Table("Costs by rule", ["rule", "jobs", "wall s", "processor s", "peak MB"], rows)],
    )
