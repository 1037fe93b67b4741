"""Synchrosqueezed images of windows of two revolutions, scaled as the reference's healthy state.

A reference without a healthy window scales them by its first one.
"""

from dataclasses import replace

import numpy as np

from job import open_log
from rippletwin import store
from rippletwin.learning.synchrosqueezing import SstSettings, amplitude_scale, sst_images

report_progress = open_log(snakemake)
reference = store.load(snakemake.input.reference)
rate = reference.sizes["time"] * reference.speed_hz
settings = SstSettings(**snakemake.params.sst)
first = int(np.argmax(reference.state.values == "H"))  # 0 where none is
scaling = np.tile(reference.signal.values[first : first + 1], 2)
settings = replace(settings, scale=amplitude_scale(scaling, rate, settings))
for source, target in zip(snakemake.input.samples, snakemake.output, strict=True):
    samples = store.load(source)
    images = sst_images(samples.signal.values, rate, settings)
    axes = (samples.signal.dims[0], "channel", "frequency", "column")
    store.save(
        samples.drop_vars("signal").assign(signal=(axes, images, {"units": "1"})),
        target,
        compressed=False,
    )
report_progress(
    f"{len(images)} images of {settings.size} x {settings.size} a store, scale {settings.scale:.3g}"
)
