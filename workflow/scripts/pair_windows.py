"""Recorded windows of one revolution -> windows of two, none of them used twice."""

import numpy as np

from job import open_log
from rippletwin import store
from rippletwin.learning.windows import pair_windows

report_progress = open_log(snakemake)
recorded = store.load(snakemake.input.recorded)
first, second = (recorded.isel(window=at) for at in pair_windows(recorded.recording.values))
both = np.concatenate([first.signal.values, second.signal.values], axis=-1)
store.save(
    first.drop_vars("signal").assign(
        signal=(("window", "channel", "time"), both, recorded.signal.attrs)
    ),
    snakemake.output[0],
)
report_progress(f"{len(both)} windows")
