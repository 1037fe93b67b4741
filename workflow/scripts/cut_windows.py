"""Windows of one revolution from every reference recording at the diagnosed operating point."""

from pathlib import Path

import numpy as np
import xarray as xr

from job import open_log
from rippletwin import store
from rippletwin.case.diagnosed_point import reference_recordings
from rippletwin.case.load import load_case, unread_recordings
from rippletwin.case.rig_yaml import read_sheet
from rippletwin.learning.dataset import UNKNOWN, remove_mean
from rippletwin.spectra.noise import noise_mad
from rippletwin.spectra.observation import revolutions_of

report_progress = open_log(snakemake)
params = snakemake.params
rig = Path(snakemake.input.rig)
labels = [recording.label for recording in reference_recordings(unread_recordings(read_sheet(rig)))]
case = load_case(rig.parent, labels=labels)
chosen = case.recordings
cut = [revolutions_of(r, case.rig, params.samples) for r in chosen]
windows = [revolutions.windows[: params.windows] for revolutions in cut]
counts = [len(w) for w in windows]
healthy = [k for k, r in enumerate(chosen) if r.state == "healthy"] or range(len(chosen))
noise = np.mean([noise_mad(chosen[k].pressure) for k in healthy], axis=0)
details = "median absolute deviation of finest wavelet details"

store.save(
    xr.Dataset(
        {
            "signal": (
                ("window", "channel", "time"),
                remove_mean(np.concatenate(windows)),
                {"units": "Pa", "long_name": "pressure without its mean"},
            ),
            "noise_std": ("channel", noise, {"units": "Pa", "source": details}),
        },
        coords={
            "state": ("window", np.repeat([r.state_code or UNKNOWN for r in chosen], counts)),
            "recording": ("window", np.repeat(range(len(chosen)), counts)),
            "window_speed_hz": ("window", np.hstack([r.speed_hz[:n] for r, n in zip(cut, counts)])),
            "channel": [sensor.name for sensor in case.rig.sensors],
        },
        attrs={
            "speed_hz": float(np.mean([np.mean(r.speed_hz) for r in cut])),
            "load_pressure": chosen[0].load_pressure,
            "sampling_rate_hz": float(np.mean([r.sampling_rate_hz for r in cut])),
            "source": ", ".join(r.file.name for r in chosen),
            "labels": [r.label for r in chosen],
        },
    ),
    snakemake.output[0],
)
report_progress(f"{sum(counts)} windows of {', '.join(r.label for r in chosen)}")
