"""Opens the seal of one case, all verdicts being committed to, and weighs what it held."""

import json
from pathlib import Path

from concealed.oracle import worth
from job import start
from virtualrig.seal import open_seal

tell = start(snakemake)
sealed = json.loads(Path(snakemake.input.seal).read_text())
truth = open_seal(sealed, Path(snakemake.input.key).read_bytes())
found = worth(snakemake.input.case, truth)
Path(snakemake.output[0]).write_text(json.dumps({"worth": found}) + "\n")
tell(f"worth {found}")
