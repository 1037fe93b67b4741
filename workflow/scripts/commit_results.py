"""Digests of all seals and of what a tool made of their cases, before any seal is opened."""

import json

from concealed.commitments import sha256_of_files
from job import open_log
from rippletwin import store

report_progress = open_log(snakemake)
paths = [*snakemake.input.seals, *snakemake.input.results]
store.write_text(snakemake.output[0], json.dumps(sha256_of_files(paths), indent=1) + "\n")
report_progress(f"{len(paths)} files committed to")
