"""The workflow plans the same jobs wherever it is started from."""

import re
from functools import cache

import pytest

from forked_snakemake import run_snakemake
from paths import ROOT


@cache
def job_counts(*options: str) -> dict[str, int]:
    """Rule -> jobs that a dry run from the repository's root plans."""
    result = run_snakemake(ROOT, "--cores", "1", "--dry-run", "--quiet", "rules", *options)
    text = result.stdout + result.stderr
    assert result.returncode == 0, text
    table = re.search(r"^Job stats:\njob .*\n-+ .*\n((?:.+\n)+)", text, re.M)
    return {line.split()[0]: int(line.split()[1]) for line in table[1].splitlines()}


@pytest.mark.parametrize(
    "start",
    [
        ("--snakefile", "workflow/Snakefile", "--configfile", "config/smoke.yaml"),
        ("--snakefile", "workflow/Snakefile", "--directory", ".test"),
    ],
)
def test_same_jobs_as_from_the_root(start):
    """The catalog's entry point, also in the folder `.test` whose own configuration is the smoke
    run's, plans the jobs that the root's Snakefile plans with that configuration."""
    fresh = ("--config", "results=not_there")
    counts = job_counts("--configfile", "config/smoke.yaml", *fresh)
    assert counts["total"] > 100
    assert job_counts(*start, *fresh) == counts
