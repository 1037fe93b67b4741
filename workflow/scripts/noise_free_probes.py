"""Every state without noise, begun at several crank angles: what attention is measured on."""

import numpy as np
import xarray as xr

from job import open_log
from rippletwin import store
from rippletwin.learning.windows import noise_free_probes

TURNS = 8  # crank angles at which a window begins

report_progress = open_log(snakemake)
seeds = store.load(snakemake.input.signals)
probes = noise_free_probes(seeds.signal.values, TURNS, int(snakemake.wildcards.revolutions))
store.save(
    xr.Dataset(
        {"signal": (("sample", "channel", "time"), probes, seeds.signal.attrs)},
        coords={
            "channel": seeds.channel.values,
            "state": ("sample", np.repeat(seeds.state.values, TURNS)),
        },
        attrs=seeds.attrs,
    ),
    snakemake.output[0],
)
report_progress(f"{len(probes)} windows")
