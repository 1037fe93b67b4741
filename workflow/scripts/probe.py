"""Every state without noise, begun at several crank angles: what attention is measured on."""

import numpy as np
import xarray as xr

from job import start
from rippletwin import store
from rippletwin.learning.dataset import remove_mean

TURNS = 8  # beginnings, evenly spread over the revolution

tell = start(snakemake)
seeds = store.load(snakemake.input.signals)
signal = remove_mean(seeds.signal.values)
steps = np.arange(TURNS) * signal.shape[-1] // TURNS
turned = np.stack([np.roll(signal, -step, axis=-1) for step in steps], axis=1)
samples = np.tile(turned, int(snakemake.wildcards.revolutions)).reshape(
    -1, signal.shape[1], signal.shape[-1] * int(snakemake.wildcards.revolutions)
)
store.save(
    xr.Dataset(
        {"signal": (("sample", "channel", "time"), samples.astype("f4"), seeds.signal.attrs)},
        coords={
            "channel": seeds.channel.values,
            "state": ("sample", np.repeat(seeds.state.values, TURNS)),
            "turn": ("sample", np.tile(np.arange(TURNS), len(signal))),
        },
        attrs=seeds.attrs,
    ),
    snakemake.output[0],
)
tell(f"{len(samples)} windows")
