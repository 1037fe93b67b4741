"""Recorded pressure windows -> flow at the pump outlet, by the calibrated line."""

import xarray as xr

from job import start
from rippletwin import store
from rippletwin.flow_sensor.line import network_of
from rippletwin.flow_sensor.spectral import estimate_flow
from rippletwin.report import load_twin
from rippletwin.spectra import noise_cycle_scatter

tell = start(snakemake)
recorded = store.load(snakemake.input.recorded)
estimate = estimate_flow(
    recorded.signal.values,
    recorded.speed_hz,
    network_of(load_twin(snakemake.input.twin), recorded.load_pressure),
    recorded.noise_std.values,
    snakemake.params.bandwidth_hz,
)
healthy = recorded.state.values == "H"
# Nothing is left above the bandwidth for wavelet details to find: the noise is what scatters.
noise = noise_cycle_scatter(estimate.flow[healthy][:, None])
store.save(
    xr.Dataset(
        {
            "signal": (
                ("window", "channel", "time"),
                estimate.flow[:, None],
                {"units": "m3/s"},
            ),
            "noise_std": (
                "channel",
                noise,
                {"units": "m3/s", "source": "scatter between revolutions"},
            ),
        },
        coords={
            "state": recorded.state,
            "recording": recorded.recording,
            "channel": ["outlet"],
        },
        attrs=recorded.attrs
        | {
            "source": f"spectral flow sensor on {recorded.source}",
            "bandwidth_hz": snakemake.params.bandwidth_hz,
        },
    ),
    snakemake.output[0],
)
tell(
    f"{len(estimate.flow)} windows, {len(estimate.orders)} shaft orders, noise {noise[0]:.2g} m3/s"
)
