"""Snakemake's own check of the rules."""

import re
import subprocess
import sys

from paths import ROOT

ONE_ENVIRONMENT = "Specify a conda environment or container for each rule."


def test_rules_have_no_lints():
    """Snakemake finds nothing but that rules name no software of their own: all jobs run in the
    environment of environment.txt."""
    command = [sys.executable, "-m", "snakemake", "--lint"]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    told = result.stdout + result.stderr
    assert "Lints for rule explain" in told, told[-3000:]
    assert set(re.findall(r"^    \* (.*):$", told, re.M)) == {ONE_ENVIRONMENT}, told[-3000:]
