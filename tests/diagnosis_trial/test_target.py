"""The target `diagnosis_trial` of the workflow, from drawing to the page."""

import json
import os
import subprocess
import sys

import pytest

from concealed.jail import landlock_version
from paths import ROOT
from virtualrig.draw_population import STATES


@pytest.mark.long
@pytest.mark.skipif(landlock_version() < 1, reason="this kernel has no Landlock")
def test_one_rig_from_drawing_to_the_page(tmp_path):
    """The target runs, nothing crashes, and every state is scored as the diagnosis says."""
    columns = ["anchored@calibrated", "unanchored@calibrated", "PRA@calibrated", "P@nominal"]
    columns += ["QR@calibrated"]
    trial = f"{{rigs: 1, number: 1001, methods: [{', '.join(columns)}]}}"
    (tmp_path / "one.yaml").write_text(f"results: {tmp_path}/out\ndiagnosis_trial: {trial}\n")
    command = [sys.executable, "-m", "snakemake", "--cores", "2", "--configfile"]
    command += [str(tmp_path / "one.yaml"), "--directory", str(ROOT), "diagnosis_trial"]
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, env=environment)
    assert result.returncode == 0, result.stderr
    folder = tmp_path / "out" / "diagnosis_trial"
    rows = json.loads((folder / "rows.json").read_text())
    told = json.loads((folder / "diagnosed" / "000" / "diagnosis.json").read_text())
    assert list(told) == columns
    for column in columns:
        made = {row["label"]: row for row in rows if row["column"] == column}
        said = {entry["label"]: entry["state"] for entry in told[column]["recordings"]}
        assert {label: row["told"] for label, row in made.items()} == said
    asked = [row["state"] for row in rows if row["column"] == columns[0]]
    assert sorted(asked) == sorted(STATES)
    assert "crashed" not in {row["told"] for row in rows}
    assert "## Smallest leak" in (folder / "report.md").read_text()
