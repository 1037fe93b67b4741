"""Digests of all seals and diagnoses, before any seal is opened."""

import json
from pathlib import Path

from concealed.commitments import sha256_of_files
from job import open_log

report_progress = open_log(snakemake)
paths = [*snakemake.input.seals, *snakemake.input.diagnoses, *snakemake.input.runs]
Path(snakemake.output[0]).write_text(json.dumps(sha256_of_files(paths), indent=1) + "\n")
report_progress(f"{len(paths)} files committed to")
