"""Synchrosqueezed images of recorded and simulated pressure, and how alike they are."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from job import start
from rippletwin import store
from rippletwin.case.load import load_case
from rippletwin.figures import diagnosis
from rippletwin.figures.style import save
from rippletwin.learning.dataset import remove_mean
from rippletwin.learning.synchrosqueezing import (
    SstSettings,
    amplitude_scale,
    image_axes,
    image_similarity,
    sst_images,
)

WINDOWS = 8  # of each recording, two revolutions each
PICTURE = 128  # pixels a side of what is drawn; numbers are those of the networks' images
NAMES = {"CFD-P": "uncalibrated", "CFD-MOC-P": "calibrated", "CFD-MOC-P+": "corrected"}

tell = start(snakemake)
params = snakemake.params
pistons = load_case(Path(snakemake.input.rig).parent, states=()).rig.pump["pistons"]
recorded = store.load(snakemake.input.recorded)
rate = recorded.sizes["time"] * recorded.speed_hz


def pairs(state):
    """Windows of two revolutions of a state, or of a cylinder fault of whatever severity."""
    known = recorded.state.values
    state = state if state in known else state[0]
    values = recorded.signal.values[known == state]
    count = min(len(values) // 2, WINDOWS)
    return state, np.concatenate([values[0 : 2 * count : 2], values[1 : 2 * count : 2]], axis=-1)


simulated = {
    NAMES[name]: store.load(path)
    for name, path in zip(params.datasets, snakemake.input.seeds, strict=True)
}


def revolved(title, state):
    """Two revolutions (1, channels, time) of a simulated state."""
    return np.tile(remove_mean(simulated[title].signal.sel(state=state).values)[None], 2)


states = [
    str(state) for state in next(iter(simulated.values())).state.values if len(pairs(str(state))[1])
]
settings = SstSettings(**params.sst)
# one scale for all, so that amplitudes compare
reference = pairs(states[0])[1]
settings = replace(settings, scale=amplitude_scale(reference, rate, settings))
large = replace(settings, size=PICTURE)

rows, pictures = [], {}  # a row of pictures a state
for state in states:
    name, windows = pairs(state)
    seen = sst_images(windows, rate, settings) - 1  # exp(0): silence
    title = f"{state}: recorded" + (f" ({name})" if name != state else "")
    pictures[title] = sst_images(windows[:1, :1], rate, large)[0, 0]
    candidates = {"recorded": seen[-1]} if len(seen) > 1 else {}
    for title in simulated:
        candidates[title] = sst_images(revolved(title, state), rate, settings)[0] - 1
    for title, image in candidates.items():
        others = seen[:-1] if title == "recorded" else seen
        alike, amplitude = np.array([image_similarity(one, image) for one in others]).T
        rows.append(
            dict(state=state, recorded=name, source=title, windows=len(others))
            | dict(similarity=alike.mean(), similarity_std=alike.std())
            | dict(amplitude=amplitude.mean(), amplitude_std=amplitude.std())
        )
        if title in simulated:
            picture = sst_images(revolved(title, state)[:, :1], rate, large)[0, 0]
            pictures[f"{state}: {title}, {alike.mean():.2f}"] = picture
table = pd.DataFrame(rows)
table.to_csv(snakemake.output.table, index=False)
frequency_hz, _ = image_axes(large, 2 / recorded.speed_hz)
amplitudes = {title: np.log(picture) / settings.k for title, picture in pictures.items()}
figure = diagnosis.sst(
    amplitudes,
    frequency_hz,
    recorded.speed_hz,
    pistons,
    columns=1 + len(simulated),
    label="amplitude over the largest of the healthy recording",
    top=1.0,
)
save(figure, snakemake.output.png, snakemake.output.svg)
tell(", ".join(f"{title} {rows.similarity.mean():.2f}" for title, rows in table.groupby("source")))
