"""Costs of a run of the workflow: time and peak memory of each rule, disk space.

    python benchmarks/run_costs.py [results]

Reads the benchmark files of the workflow. Wall seconds are summed over jobs: a run on two cores
takes about half of the sum. Resident memory is that of the largest job.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import pandas as pd


def jobs_of(results: Path) -> pd.DataFrame:
    """One row for each job that has ended: rule, wall_s, cpu_s, resident memory peak_mb, and when
    its file was written, s."""
    rows = []
    folder = results / "benchmarks"
    for path in sorted(folder.rglob("*.tsv")):
        row = pd.read_csv(path, sep="\t", na_values="-").iloc[0]
        rule = path.relative_to(folder).with_suffix("").parts[0]
        rows.append((rule, row["s"], row["cpu_time"], row["max_rss"], path.stat().st_mtime))
    return pd.DataFrame(rows, columns=["rule", "wall_s", "cpu_s", "peak_mb", "ended"])


def by_rule(jobs: pd.DataFrame) -> pd.DataFrame:
    """One row for each rule of ``jobs_of``, the costliest first: jobs, wall and processor seconds,
    largest resident memory (MB)."""
    grouped = jobs.groupby("rule")
    return pd.DataFrame(
        {
            "jobs": grouped.size(),
            "wall_s": grouped.wall_s.sum(),
            "cpu_s": grouped.cpu_s.sum(),
            "peak_mb": grouped.peak_mb.max(),
        }
    ).sort_values("wall_s", ascending=False)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("results", type=Path, nargs="?", default=Path("results"))
    results = parser.parse_args().results
    if not any((results / "benchmarks").rglob("*.tsv")):
        parser.error(f"{results}: holds no benchmark files; run the workflow first")
    table = by_rule(jobs_of(results))
    print(table.round().to_string())
    size = sum(path.stat().st_size for path in results.rglob("*") if path.is_file())
    print(f"all: {table.wall_s.sum():.0f} s of jobs, largest job {table.peak_mb.max():.0f} MB")
    print(f"disk: {size / 1e6:.0f} MB in {results}")


if __name__ == "__main__":
    main()
