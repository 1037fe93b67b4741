"""Opens the seal of one case, after all verdicts are committed, and fits it from the truth."""

import json

from concealed.oracle import fit_from_truth
from job import open_log
from rippletwin import store
from virtualrig.seal import open_seal_file

report_progress = open_log(snakemake)
truth = open_seal_file(snakemake.input.seal, snakemake.input.key)
found = fit_from_truth(snakemake.input.case, truth)
store.write_text(snakemake.output[0], json.dumps(found) + "\n")
report_progress(f"log evidence {found['log_evidence']}, held out {found['held_out']}")
