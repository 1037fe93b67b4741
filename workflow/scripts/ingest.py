"""Windows of one revolution from every recording at the diagnosed operating point."""

from pathlib import Path

import numpy as np
import xarray as xr

from job import start
from rippletwin import store
from rippletwin.case.load import load_case
from rippletwin.learning.dataset import remove_mean
from rippletwin.spectra.noise import noise_cycle_scatter, noise_mad
from rippletwin.spectra.observation import revolutions_of

tell = start(snakemake)
params = snakemake.params
case = load_case(Path(snakemake.input.rig).parent)

# The operating point to diagnose is that of the recordings that are not healthy.
periodic = [r for r in case.recordings if r.kind == "periodic"]
point = next((r for r in periodic if r.state != "healthy"), periodic[0])
chosen = [
    r for r in periodic if (r.speed_rpm, r.load_pressure) == (point.speed_rpm, point.load_pressure)
]
cut = [revolutions_of(r, case.rig, params.samples) for r in chosen]
windows = [revolutions.windows[: params.windows] for revolutions in cut]
counts = [len(w) for w in windows]
healthy = [k for k, r in enumerate(chosen) if r.state == "healthy"] or range(len(chosen))
names = [sensor.name for sensor in case.rig.sensors]

store.save(
    xr.Dataset(
        {
            "signal": (
                ("window", "channel", "time"),
                remove_mean(np.concatenate(windows)),
                {"units": "Pa", "long_name": "pressure without its mean"},
            ),
            "noise_std": (
                "channel",
                np.mean([noise_mad(chosen[k].pressure) for k in healthy], axis=0),
                {"units": "Pa", "source": "median absolute deviation of finest wavelet details"},
            ),
            "cycle_scatter": (
                "channel",
                np.mean([noise_cycle_scatter(windows[k]) for k in healthy], axis=0),
                {"units": "Pa", "source": "scatter between revolutions"},
            ),
        },
        coords={
            "state": ("window", np.repeat([r.state_code or "?" for r in chosen], counts)),
            "recording": ("window", np.repeat(range(len(chosen)), counts)),
            "channel": names,
        },
        attrs={
            "speed_hz": float(np.mean([np.mean(r.speed_hz) for r in cut])),
            "load_pressure": point.load_pressure,
            "sampling_rate_hz": float(np.mean([r.sampling_rate_hz for r in cut])),
            "source": ", ".join(r.file.name for r in chosen),
        },
    ),
    snakemake.output[0],
)
tell(f"{sum(counts)} windows of {', '.join(r.label for r in chosen)}")
