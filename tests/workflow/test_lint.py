"""Snakemake's own check of the rules."""

import re

from forked_snakemake import run_snakemake
from paths import ROOT

ONE_ENVIRONMENT = "Specify a conda environment or container for each rule."


def test_rules_have_no_lints():
    """Snakemake finds nothing but that rules name no software of their own: all jobs run in the
    environment of environment.txt."""
    result = run_snakemake(ROOT, "--lint")
    told = result.stdout + result.stderr
    assert "Lints for rule explain" in told, told[-3000:]
    assert set(re.findall(r"^    \* (.*):$", told, re.M)) == {ONE_ENVIRONMENT}, told[-3000:]
