"""Opens the seal of one case, all verdicts being committed to, and weighs what it held."""

import json
from pathlib import Path

from concealed.oracle import worth
from job import start
from virtualrig.seal import open_seal_file

tell = start(snakemake)
truth = open_seal_file(snakemake.input.seal, snakemake.input.key)
found = worth(snakemake.input.case, truth)
Path(snakemake.output[0]).write_text(json.dumps({"worth": found}) + "\n")
tell(f"worth {found}")
