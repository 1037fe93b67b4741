"""Labelled samples of one seed: every state shifted and noisy."""

import numpy as np
import xarray as xr

from job import start
from rippletwin import store
from rippletwin.dataset import augment

tell = start(snakemake)
params, wildcards = snakemake.params, snakemake.wildcards
signals = store.load(snakemake.input.signals)
recorded = store.load(snakemake.input.recorded)
samples, labels = augment(
    signals.signal.values,
    params.samples_per_class,
    recorded.noise_std.values,
    np.random.default_rng([int(wildcards.seed), int(wildcards.revolutions)]),
    int(wildcards.revolutions),
    params.noise,
)
store.save(
    xr.Dataset(
        {
            "signal": (("sample", "channel", "time"), samples, signals.signal.attrs),
            "label": ("sample", labels, {"classes": signals.state.values.tolist()}),
        },
        coords={"channel": signals.channel.values},
        attrs=signals.attrs | {"seed": int(wildcards.seed)},
    ),
    snakemake.output[0],
    compressed=False,
)
tell(f"{len(labels)} samples")
