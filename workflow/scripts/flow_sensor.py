"""Recorded pressure windows -> flow at the pump outlet, by the line of a twin."""

import numpy as np
import xarray as xr
from rippletwin.flow_sensor.line import network_of
from rippletwin.flow_sensor.spectral import estimate_flow
from rippletwin.report import load_twin

from job import start
from rippletwin import store
from rippletwin.spectra import noise_cycle_scatter

tell = start(snakemake)
params = snakemake.params
recorded = store.load(snakemake.input.recorded)
network = network_of(load_twin(snakemake.input.twin), recorded.load_pressure)
told = recorded.noise_std.values, params.bandwidth_hz


def by_network(windows):
    """The physics-informed network: trained once for this line, then solved a window at a time."""
    import torch

    from rippletwin.flow_sensor import pinn

    torch.set_num_threads(snakemake.threads)
    settings = pinn.Settings(width=params.width, steps=params.steps)

    def progress(step, loss):
        if step % 50 == 0:
            tell(f"step {step}: loss {loss:.2g}")

    speed_hz = recorded.speed_hz
    trunk, _ = pinn.train(network, speed_hz, params.bandwidth_hz, settings, progress)
    tell(f"equations hold to {float(trunk.residual):.2g} of the waves")
    return pinn.estimate_flow(windows, speed_hz, network, trunk, *told)


windows = recorded.signal.values
if params.method == "pinn":
    estimate = by_network(windows)
else:
    estimate = estimate_flow(windows, recorded.speed_hz, network, *told)
# Nothing is left above the bandwidth for wavelet details to find: the noise is what scatters.
recording, healthy = recorded.recording.values, recorded.state.values == "H"
noise = np.mean(
    [
        noise_cycle_scatter(estimate.flow[recording == k][:, None])
        for k in np.unique(recording[healthy] if healthy.any() else recording)
    ],
    axis=0,
)
line = "corrected" if snakemake.wildcards.plus else "calibrated"
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
            "source": f"{params.method} flow sensor, {line} line, on {recorded.source}",
            "bandwidth_hz": params.bandwidth_hz,
        },
    ),
    snakemake.output[0],
)
tell(
    f"{len(estimate.flow)} windows, {len(estimate.orders)} shaft orders, noise {noise[0]:.2g} m3/s"
)
