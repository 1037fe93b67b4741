"""Where the time of runs of the workflow goes, by rule, from the runs' own benchmark files."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pandas as pd

from run_costs import by_rule, jobs_of
from speed import run_trainings
from speed.machine import describe
from speed.result import Chart, Claim, Result, Table
from speed.starting import SCRIPTS, script_seconds

RULES = SCRIPTS.parent / "rules"
DEFAULT_RUN, SMOKE_RUN = "RIPPLETWIN_BENCH_RUN", "RIPPLETWIN_BENCH_SMOKE"
"""Environment variables: results folders of a finished default run and of a finished smoke run."""
CORES = 2
MOST_IMPORTS = 20.0  # per cent of a job's time
SMOKE_MINUTES, MINUTES, MINUTES_WITH_BFLOAT16 = 3.0, 100.0, 60.0
LONGEST_WAIT_S = 60.0  # for the next job, while Snakemake plans; a longer one is an interruption
TRAININGS = "Wall seconds of the default run's trainings, all seeds of a network on a dataset"
TAKEN = (
    "from the first job's start to the last one's end; neither Snakemake's own start nor an "
    "interruption is in it"
)


def run(quick: bool = False) -> Result:
    """Minutes, charts and tables of the finished runs that are named; imports are measured here."""
    claims, tables, charts, bound, notes = [], [], [], [], []
    for text, variable, target in (
        ("default run, images of 64 pixels, two cores", DEFAULT_RUN, default_minutes()),
        ("smoke run, two cores", SMOKE_RUN, SMOKE_MINUTES),
    ):
        results = Path(os.environ.get(variable, "not_there"))
        jobs = jobs_of(results)
        if jobs.empty:
            claims.append(Claim(text, None, target, "min", at_least=False))
            notes.append(f"Not measured: no finished run was named in {variable}.")
            continue
        claims.append(Claim(text, minutes_of(jobs), target, "min", at_least=False, note=TAKEN))
        jobs = with_imports(jobs)
        name, rules = text.split(",")[0], rules_of(jobs)
        claims += import_claims(name, jobs)
        tables.append(cost_table(f"Costs of the {name} by rule", rules))
        if variable == DEFAULT_RUN:
            seconds = run_trainings.training_seconds(results)
            tables.append(run_trainings.training_table(TRAININGS, seconds))
            bound += run_trainings.bound_sentences(results, seconds, jobs.wall_s.sum(), CORES)
        charts.append(
            Chart(
                file=f"{name.replace(' ', '_')}.svg",
                title=f"Where does the time of the {name} go?",
                labels=list(rules.index),
                values=rules.wall_s.tolist(),
                parts=rules.import_s.fillna(0.0).tolist(),
                axis="wall seconds, summed over jobs (orange: imports)",
            )
        )
    return Result(
        point=6,
        title="The workflow",
        what=[
            "Wall seconds of each rule, summed over its jobs, as the run itself recorded them.",
            "Imports are the processor seconds that the rule's script needs for them on this "
            "machine; a share is over the job's wall seconds, at most all of them.",
            "The first run in a clone takes longer, because it compiles code.",
        ],
        claims=claims,
        tables=tables,
        bound=bound,
        notes=notes,
        charts=charts,
    )


def default_minutes() -> float:
    """Target of the default run on this processor."""
    there = describe()["instructions"]
    return MINUTES_WITH_BFLOAT16 if there["avx512_bf16"] or there["amx_bf16"] else MINUTES


def minutes_of(jobs: pd.DataFrame) -> float:
    """Length of a run (``jobs_of``): by the times of its files, which copies have lost, and never
    less than all cores need for its jobs. Waits of more than LONGEST_WAIT_S do not count: the run
    was interrupted and continued."""
    began = (jobs.ended - jobs.wall_s).sort_values()
    all_ended = jobs.ended[began.index].cummax()  # the last end of the jobs that have begun
    waits = (began - all_ended.shift()).clip(lower=0.0)
    taken = all_ended.max() - began.min() - waits[waits > LONGEST_WAIT_S].sum()
    return max(taken, jobs.wall_s.sum() / CORES) / 60


def with_imports(jobs: pd.DataFrame) -> pd.DataFrame:
    """The jobs (``jobs_of``) with a column import_s, NaN where a rule runs no script."""
    scripts = {rule: script_of(rule) for rule in jobs.rule.unique()}
    seconds = {path: script_seconds(path) for path in set(scripts.values()) if path}
    each = jobs.rule.map({rule: seconds.get(path) for rule, path in scripts.items()})
    return jobs.assign(import_s=each.astype(float).clip(upper=jobs.wall_s))


def script_of(rule: str) -> Path | None:
    """The script of a rule, which has its name or that of the rule it is made from."""
    text = "\n".join(path.read_text() for path in sorted(RULES.glob("*.smk")))
    made_from = {own: base for base, own in re.findall(r"use rule (\w+) as (\w+)", text)}
    path = SCRIPTS / f"{made_from.get(rule, rule)}.py"
    return path if path.exists() else None


def import_claims(name: str, jobs: pd.DataFrame) -> list[Claim]:
    """Shares of imports, per cent: the largest of a job, and that of all jobs together."""
    known = jobs.dropna(subset=["import_s"])
    shares = 100.0 * known.import_s / known.wall_s
    over = int((shares > MOST_IMPORTS).sum())
    worst = known.rule[shares.idxmax()]
    note = f"{over} of {len(known)} jobs are above {MOST_IMPORTS:.0f} %; the largest is of {worst}"
    whole = 100.0 * known.import_s.sum() / known.wall_s.sum()
    return [
        Claim(f"{name}: imports in a job, largest share", float(shares.max()), MOST_IMPORTS, "%",
              at_least=False, note=note),
        Claim(f"{name}: imports in all jobs together", float(whole), None, "%"),
    ]  # fmt: skip


def rules_of(jobs: pd.DataFrame) -> pd.DataFrame:
    """``by_rule`` with the imports' seconds, and the largest share of a job, per cent."""
    share = 100.0 * jobs.import_s / jobs.wall_s
    imports = jobs.assign(share=share).groupby("rule")
    return by_rule(jobs).assign(
        import_s=imports.import_s.sum(min_count=1), share=imports.share.max()
    )


def cost_table(caption: str, rules: pd.DataFrame) -> Table:
    """The rules as rows of texts, the costliest first."""
    columns = ["rule", "jobs", "wall s", "processor s", "peak MB", "imports s", "largest share"]
    rows = [
        [rule, int(row.jobs), *(f"{x:.0f}" for x in (row.wall_s, row.cpu_s, row.peak_mb))]
        + (["–", "–"] if pd.isna(row.share) else [f"{row.import_s:.1f}", f"{row.share:.0f} %"])
        for rule, row in rules.iterrows()
    ]
    return Table(caption, columns, rows)
