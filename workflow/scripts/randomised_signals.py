"""Many revolutions a class, of random severities and twins: some to learn from, some held out."""

import numpy as np
import xarray as xr

from job import open_log
from rippletwin import store
from rippletwin.diagnosis.randomised_signals import SignalSource, severity_bins
from rippletwin.flow_sensor.estimate import band_limit
from rippletwin.learning.architectures import CLASSES
from rippletwin.learning.windows import early_healthy
from rippletwin.twin.twin_file import load_covariance, load_twin

report_progress = open_log(snakemake)
params, twin = snakemake.params, load_twin(snakemake.input.twin, snakemake.input.effects)
recorded = store.load(snakemake.input.recorded)
at = early_healthy(recorded.state.values, recorded.recording.values, params.learnt_share)
source = SignalSource(
    twin,
    load_covariance(snakemake.input.twin),
    recorded.signal.values[at].astype(float),
    recorded.speed_hz,
    recorded.load_pressure,
)
report_progress(f"the twin leaves {source.overall_misfit:.1%} of the healthy ripple")
bins = severity_bins(params.severity, params.limit)
is_flow = params.signal == "flow"
for seed, path in enumerate(snakemake.output):
    rng = np.random.default_rng(seed)
    drawn = source.draw(bins, CLASSES, params.draws, rng, params.anchored)
    values = drawn.pressure
    if is_flow:
        values = band_limit(drawn.flow, recorded.speed_hz, params.bandwidth_hz)
    units = {"units": "m3/s" if is_flow else "Pa"}
    store.save(
        xr.Dataset(
            {
                "signal": (
                    ("state", "draw", "channel", "time"),
                    values.astype(np.float32),
                    units,
                ),
                "leak_area": (("state", "draw"), drawn.leak_area, {"units": "m2"}),
            },
            coords={
                "state": list(CLASSES),
                "channel": ["outlet"] if is_flow else recorded.channel.values,
            },
            attrs={"speed_hz": recorded.speed_hz, "misfit": source.overall_misfit}
            | {"source": f"twins drawn from {snakemake.input.twin}"},
        ),
        path,
        compressed=False,
    )
report_progress(f"{params.draws} revolutions a class")
