"""The noise-free revolution of every state in one store; flow as far as a sensor sees it."""

import numpy as np
import xarray as xr

from job import open_log
from rippletwin import store
from rippletwin.flow_sensor.estimate import band_limit

report_progress = open_log(snakemake)
params = snakemake.params
stores = [store.load(path) for path in snakemake.input.states]
signals = [dataset[params.signal] for dataset in stores]
values = np.array([np.atleast_2d(signal.values) for signal in signals])
if signals[0].attrs["units"] == "m3/s":
    values = band_limit(values, stores[0].attrs["speed_hz"], params.bandwidth_hz)
store.save(
    xr.Dataset(
        {"signal": (("state", "channel", "time"), values, signals[0].attrs)},
        coords={
            "state": [dataset.attrs["state"] for dataset in stores],
            "channel": signals[0].channel.values if "channel" in signals[0].dims else ["outlet"],
        },
        attrs={key: stores[0].attrs[key] for key in ("speed_hz", "source")},
    ),
    snakemake.output[0],
)
report_progress(f"{len(stores)} states from {stores[0].attrs['source']}")
