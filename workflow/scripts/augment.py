"""Labelled samples of every seed: each state shifted and noisy."""

import numpy as np
import xarray as xr

from job import open_log
from rippletwin import store
from rippletwin.learning.dataset import augment

report_progress = open_log(snakemake)
params, revolutions = snakemake.params, int(snakemake.wildcards.revolutions)
signals = store.load(snakemake.input.signals)
recorded = store.load(snakemake.input.recorded)
for seed, path in enumerate(snakemake.output):
    samples, labels = augment(
        signals.signal.values,
        params.samples_per_class,
        recorded.noise_std.values,
        np.random.default_rng([seed, revolutions]),
        revolutions,
        params.noise,
    )
    store.save(
        xr.Dataset(
            {
                "signal": (("sample", "channel", "time"), samples, signals.signal.attrs),
                "label": ("sample", labels, {"classes": signals.state.values.tolist()}),
            },
            coords={"channel": signals.channel.values},
            attrs=signals.attrs | {"seed": seed},
        ),
        path,
        compressed=False,
    )
report_progress(f"{len(labels)} samples a seed, {len(snakemake.output)} seeds")
