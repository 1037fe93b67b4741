"""Synchrosqueezed images of windows of two revolutions, scaled as the reference's healthy state.

A reference without a healthy window scales them by its first one.
"""

from concurrent.futures import ThreadPoolExecutor
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


def save_images(source: str, target: str) -> int:
    """Number of the images of the windows of `source`, which it saves to `target`."""
    samples = store.load(source)
    images = sst_images(samples.signal.values, rate, settings)
    axes = (samples.signal.dims[0], "channel", "frequency", "column")
    store.save(
        samples.drop_vars("signal").assign(signal=(axes, images, {"units": "1"})),
        target,
        compressed=False,
    )
    return len(images)


with ThreadPoolExecutor(snakemake.threads) as pool:  # the transform releases the interpreter
    counts = list(pool.map(save_images, snakemake.input.samples, snakemake.output))
report_progress(
    f"{counts[-1]} images of {settings.size} x {settings.size} a store, scale {settings.scale:.3g}"
)
