"""The paper's claims, judged on our accuracies."""

from pathlib import Path

import pandas as pd

from job import start
from rippletwin import claims
from rippletwin.case import load_case
from rippletwin.figures import attention, save

tell = start(snakemake)
paths = snakemake.output
pistons = load_case(Path(snakemake.input.rig).parent, states=()).rig.pump["pistons"]
cells = claims.cells_of(pd.read_csv(snakemake.input.table), pd.read_csv(snakemake.input.paper))
compared = claims.comparisons(cells)
judged = claims.verdicts(compared, cells, snakemake.params.samples_per_revolution / pistons)
judged.to_csv(paths.table, index=False)
compared.to_csv(paths.comparisons, index=False)
Path(paths.page).write_text(claims.markdown(judged, compared))

groups = {
    claim.split(":")[0]: (
        [
            f"{row.dataset}: {row.better} − {row.worse}"
            if claim != claims.CALIBRATION
            else f"{row.better}: {row.dataset} − {row.worse}"
            for row in rows.itertuples()
        ],
        rows[["difference", "low", "high"]].to_numpy(),
    )
    for claim, rows in compared[compared.score == claims.EITHER].groupby("claim", sort=False)
}
save(attention.claims(groups), paths.png, paths.svg)
tell(f"{len(compared)} comparisons")
