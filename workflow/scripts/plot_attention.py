"""Grad-CAM of every network of a dataset: on simulated states and on recordings."""

from pathlib import Path

import numpy as np

from job import open_log
from rippletwin import store
from rippletwin.case.load import load_case
from rippletwin.figures import attention
from rippletwin.figures.ripple import shown_unit
from rippletwin.figures.style import save
from rippletwin.learning.architectures import ARCHITECTURES
from rippletwin.learning.synchrosqueezing import SstSettings, image_axes

report_progress = open_log(snakemake)
params, output = snakemake.params, snakemake.output
cells = [store.load(path) for path in snakemake.input.attention]
networks = [ARCHITECTURES[name].title for name in params.architectures]
pistons = load_case(Path(snakemake.input.rig).parent, states=()).rig.pump["pistons"]
first = cells[0]
called = [
    [f"called {name}: {share:.0%}" for name, share in zip(cell.called.values, cell.called_share)]
    for cell in cells
]


def aligned(share, region):
    """Title of a simulated fault's panel."""
    return "no attention" if np.isnan(share) else f"{share:.0%} of it on the orange {region:.0%}"


shares = [
    ["", *(aligned(*both) for both in zip(cell.attended[0].values, cell.region.values))]
    for cell in cells
]


def draw(states, variable, titles, region=None):
    signal = first[variable].isel(channel=0).values
    heat = np.stack([cell[f"{variable}_heat"].values for cell in cells])
    if snakemake.wildcards.domain == "image":
        settings = SstSettings(**params.sst)
        frequency_hz, _ = image_axes(settings, 2 / first.speed_hz)
        axis = (frequency_hz, first.speed_hz, pistons)
        return attention.plot_images(networks, states, signal, heat, titles, *axis, region)
    scale, label = shown_unit(first.simulated.attrs["units"])
    return attention.plot_windows(networks, states, signal / scale, heat, titles, label, region)


simulated = draw(first.state.values.tolist(), "simulated", shares, first.fault_region.values)
save(simulated, output.simulated, output.simulated_svg)
save(
    draw(first.recording.values.tolist(), "recorded", called), output.recorded, output.recorded_svg
)
report_progress(f"{len(networks)} networks")
