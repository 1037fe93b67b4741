"""Synchrosqueezed images of recorded and simulated pressure, and how alike they are."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from job import open_log
from rippletwin import store
from rippletwin.case.load import load_case
from rippletwin.figures import diagnosis
from rippletwin.figures.style import save
from rippletwin.learning.image_comparison import compare_images, recorded_pairs, two_revolutions
from rippletwin.learning.synchrosqueezing import (
    SstSettings,
    amplitude_scale,
    image_axes,
    sst_images,
)

WINDOWS = 8  # of each recorded state, two revolutions each
PIXELS = 128  # a side of what is drawn; the numbers are of the networks' images

report_progress = open_log(snakemake)
pistons = load_case(Path(snakemake.input.rig).parent, states=()).rig.pump["pistons"]
recorded = store.load(snakemake.input.recorded)
rate = recorded.sizes["time"] * recorded.speed_hz
seeds = {
    title: store.load(path).signal
    for title, path in zip(snakemake.params.titles, snakemake.input.seeds, strict=True)
}
states = next(iter(seeds.values())).state.values.tolist()
of_window = recorded.state.values, recorded.recording.values
pairs = recorded_pairs(recorded.signal.values, *of_window, states, WINDOWS)
windows = {state: pair for state, (_, pair) in pairs.items()}
simulated = {
    title: {state: two_revolutions(signal.sel(state=state).values) for state in pairs}
    for title, signal in seeds.items()
}
settings = SstSettings(**snakemake.params.sst)
# one scale for all, so that amplitudes compare
settings = replace(settings, scale=amplitude_scale(next(iter(windows.values())), rate, settings))
table = compare_images(windows, simulated, rate, settings)
table.insert(1, "recorded", [pairs[state][0] for state in table.state])
store.write_table(snakemake.output.table, table)

large = replace(settings, size=PIXELS)
alike = table.set_index(["state", "source"]).similarity
signals = {}  # a row of pictures a state, the first channel
for state, (name, pair) in pairs.items():
    signals[f"{state}: recorded" + (f" ({name})" if name != state else "")] = pair[:1, :1]
    for source, of_states in simulated.items():
        signals[f"{state}: {source}, {alike[state, source]:.2f}"] = of_states[state][:, :1]
images = {title: np.log(sst_images(x, rate, large)[0, 0]) / large.k for title, x in signals.items()}
axis = image_axes(large, 2 / recorded.speed_hz)[0], recorded.speed_hz, pistons
label = f"amplitude over the largest of {next(iter(images))}"
figure = diagnosis.plot_sst(images, *axis, columns=1 + len(simulated), label=label, top=1.0)
save(figure, snakemake.output.png, snakemake.output.svg)
report_progress(f"similarity {table.groupby('source').similarity.mean().round(2).to_dict()}")
