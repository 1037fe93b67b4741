"""Opens the seal of one case, after all verdicts are committed, and fits its true effects."""

import json

from concealed.oracle import oracle_log_evidence
from job import open_log
from rippletwin import store
from virtualrig.seal import open_seal_file

report_progress = open_log(snakemake)
truth = open_seal_file(snakemake.input.seal, snakemake.input.key)
value = oracle_log_evidence(snakemake.input.case, truth)
store.write_text(snakemake.output[0], json.dumps({"oracle_log_evidence": value}) + "\n")
report_progress(f"oracle log evidence {value}")
