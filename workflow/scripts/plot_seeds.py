"""The simulated revolution of every state, and its synchrosqueezed image at the first channel.

Compound faults are shown below the single faults that they consist of.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import xarray as xr

from job import open_log
from rippletwin import store
from rippletwin.case.load import load_case
from rippletwin.figures import diagnosis, ripple
from rippletwin.figures.style import save
from rippletwin.learning.synchrosqueezing import (
    SstSettings,
    amplitude_scale,
    image_axes,
    sst_images,
)

report_progress = open_log(snakemake)
pistons = load_case(Path(snakemake.input.rig).parent, states=()).rig.pump["pistons"]
seeds, reference = store.load(snakemake.input.seeds), store.load(snakemake.input.reference)
together = {fault for state in seeds.state.values if "+" in state for fault in state.split("+")}
parts = [state for state in reference.state.values if state in together]
seeds = xr.concat([reference.sel(state=parts), seeds], "state", combine_attrs="override")
states = [str(state) for state in seeds.state.values]
signals = seeds.signal.isel(channel=0).values
signals = signals - signals.mean(axis=-1, keepdims=True)

scale, label = ripple.shown_unit(seeds.signal.attrs["units"])
angle = np.arange(signals.shape[-1]) * 360 / signals.shape[-1]
figure = ripple.plot_states(
    angle, dict(zip(states, signals)), f"{snakemake.wildcards.dataset}: {label}", scale
)
save(figure, snakemake.output.ripple, snakemake.output.ripple_svg)

windows = np.tile(signals[:, None], 2)
rate = seeds.sizes["time"] * seeds.speed_hz
settings = SstSettings(**snakemake.params.sst)
healthy = reference.signal.sel(state="H").isel(channel=[0]).values[None]
healthy = healthy - healthy.mean(axis=-1, keepdims=True)
settings = replace(settings, scale=amplitude_scale(np.tile(healthy, 2), rate, settings))
images = sst_images(windows, rate, settings)[:, 0]
frequency_hz, _ = image_axes(settings, 2 / seeds.speed_hz)
figure = diagnosis.plot_sst(dict(zip(states, images)), frequency_hz, seeds.speed_hz, pistons)
save(figure, snakemake.output.sst, snakemake.output.sst_svg)
report_progress(f"{len(states)} states")
