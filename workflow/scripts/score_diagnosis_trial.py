"""Opens the seals, if no file differs from its commitment, and scores the diagnoses."""

import json
from pathlib import Path

from concealed.commitments import check_unchanged
from diagnosis_trial.score import score_rig
from job import open_log
from rippletwin import store
from virtualrig.seal import open_seal_file

report_progress = open_log(snakemake)
paths = snakemake.input
committed = json.loads(Path(paths.commitments[0]).read_text())
check_unchanged(committed, [*paths.seals, *paths.diagnoses, *paths.runs])
rows = []
for rig, (seal, key, *results) in enumerate(
    zip(paths.seals, paths.seal_keys, paths.diagnoses, paths.runs, strict=True)
):
    diagnosis, run = (json.loads(Path(path).read_text()) for path in results)
    rows += score_rig(rig, open_seal_file(seal, key), diagnosis, run)
store.write_text(snakemake.output.rows, json.dumps(rows, indent=1) + "\n")
report_progress(f"{len(rows)} recordings scored")
