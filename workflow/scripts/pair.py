"""Recorded windows of one revolution -> windows of two, none of them used twice."""

import numpy as np
import xarray as xr

from job import start
from rippletwin import store

tell = start(snakemake)
recorded = store.load(snakemake.input.recorded)
pairs = []
for _, windows in recorded.groupby("recording"):
    even = windows.isel(window=slice(0, windows.sizes["window"] // 2 * 2))
    first, second = (even.isel(window=slice(k, None, 2)) for k in (0, 1))
    both = np.concatenate([first.signal.values, second.signal.values], axis=-1)
    pairs.append(
        first.drop_vars("signal").assign(
            signal=(("window", "channel", "time"), both, recorded.signal.attrs)
        )
    )
store.save(xr.concat(pairs, "window", data_vars="minimal"), snakemake.output[0])
tell(f"{sum(p.sizes['window'] for p in pairs)} windows")
