"""The target `concealed` of the workflow, from drawing to the page."""

import json
import os
import subprocess
import sys

import pytest

from concealed.jail import landlock_version
from paths import ROOT


@pytest.mark.long
@pytest.mark.skipif(landlock_version() < 1, reason="this kernel has no Landlock")
def test_two_cases_from_drawing_to_the_page(tmp_path):
    """The target runs, no case crashes, and the rows hold what the verdicts say."""
    config = f"results: {tmp_path}/out\nconcealed: {{cases: 2, number: 1001}}\n"
    (tmp_path / "two.yaml").write_text(config)
    command = [sys.executable, "-m", "snakemake", "--cores", "2", "--configfile"]
    command += [str(tmp_path / "two.yaml"), "--directory", str(ROOT), "concealed"]
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, env=environment)
    assert result.returncode == 0, result.stderr
    rows = json.loads((tmp_path / "out/concealed/rows.json").read_text())
    assert len(rows) == 2
    for row in rows:
        path = tmp_path / f"out/concealed/explained/{row['case']:03d}/verdict.json"
        assert row["verdict"] == json.loads(path.read_text())["verdict"] != "crashed"
    assert "## Failures" in (tmp_path / "out/concealed/report.md").read_text()
