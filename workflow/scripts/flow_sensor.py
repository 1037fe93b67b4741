"""Recorded pressure windows -> source flow of the pump, by the line of a twin."""

import xarray as xr

from job import open_log
from rippletwin import store
from rippletwin.flow_sensor.estimate import keep_orders
from rippletwin.flow_sensor.line_response import line_factory
from rippletwin.flow_sensor.methods import estimate_flow_by, noise_of_flow
from rippletwin.twin.twin_file import load_twin

report_progress = open_log(snakemake)
params = snakemake.params
recorded = store.load(snakemake.input.recorded)
speeds = recorded.window_speed_hz.values
# Networks learn simulations at the speed of `recorded`.
band = keep_orders(params.bandwidth_hz, recorded.speed_hz, speeds, recorded.sizes["time"])
estimate = estimate_flow_by(
    params.method,
    recorded.signal.values,
    speeds,
    line_factory(load_twin(snakemake.input.twin, snakemake.input.effects), recorded.load_pressure),
    recorded.noise_std.values,
    band,
    width=params.width,
    steps=params.steps,
    threads=snakemake.threads,
    progress=report_progress,
)
noise = noise_of_flow(
    estimate.flow, recorded.recording.values, healthy=recorded.state.values == "H"
)
by = f"{params.method} flow sensor, {snakemake.wildcards.twin} line, on {recorded.source}"
scatter = {"units": "m3/s", "source": "scatter between revolutions"}
store.save(
    xr.Dataset(
        {
            "signal": (("window", "channel", "time"), estimate.flow[:, None], {"units": "m3/s"}),
            "noise_std": ("channel", noise, scatter),
        },
        coords={"state": recorded.state, "recording": recorded.recording, "channel": ["outlet"]},
        attrs=recorded.attrs | {"source": by, "bandwidth_hz": params.bandwidth_hz},
    ),
    snakemake.output[0],
)
report_progress(
    f"{len(estimate.flow)} windows, {len(estimate.orders)} shaft orders, noise {noise[0]:.2g} m3/s"
)
