"""Opens the seals, if no file differs from its commitment, and scores the cases."""

import json
from pathlib import Path

from concealed.commitments import check_unchanged
from concealed.score import score_case
from job import open_log
from rippletwin import store
from virtualrig.seal import open_seal_file

report_progress = open_log(snakemake)
paths = snakemake.input
committed = json.loads(Path(paths.commitments[0]).read_text())
check_unchanged(committed, [*paths.seals, *paths.verdicts, *paths.baselines])
rows = []
for case, (seal, key, *results) in enumerate(
    zip(paths.seals, paths.seal_keys, paths.verdicts, paths.baselines, paths.oracles, strict=True)
):
    verdict, baselines, oracle = (json.loads(Path(path).read_text()) for path in results)
    row = score_case(open_seal_file(seal, key), verdict, baselines, oracle)
    rows.append({"case": case} | row)
store.write_text(snakemake.output.rows, json.dumps(rows, indent=1) + "\n")
report_progress(f"{len(rows)} cases scored")
