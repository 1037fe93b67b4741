"""The page and the figures of the concealed cases."""

import json
from pathlib import Path

from concealed.figures import draw
from concealed.page import markdown
from job import start

tell = start(snakemake)
rows = json.loads(Path(snakemake.input.rows).read_text())
checks = json.loads(Path(snakemake.input.numerics[0]).read_text())
origin = {
    "commit": snakemake.params.commit,
    "number": snakemake.params.number,
    "not_committed": snakemake.params.not_committed,
    "checks": checks,
}
draw(rows, snakemake.output.figures)
Path(snakemake.output.page).write_text(markdown(rows, origin))
tell(f"{snakemake.output.page} written")
