"""Outlet flow of the pump in one state, coupled to an uncalibrated pipe, and the pressure in it.

A state such as S+C1 is several faults together, all from the same piston on.
"""

from pathlib import Path

import xarray as xr

from job import open_log
from rippletwin import store
from rippletwin.case.load import load_case
from rippletwin.pump.named_states import simulate_state

report_progress = open_log(snakemake)
params = snakemake.params
rig = load_case(Path(snakemake.input.rig).parent, states=()).rig
recorded = store.load(snakemake.input.recordings)
in_pipe, source = simulate_state(
    rig,
    60 * recorded.speed_hz,
    recorded.load_pressure,
    params.pipe_length,
    params.leak_area,
    recorded.sizes["time"],
)
pumping_hz = rig.pump["pistons"] * recorded.speed_hz
report_progress(
    f"mean flow {in_pipe.flow.mean():.4g} m3/s, periodic to {in_pipe.change:.1g} of the ripple"
)
store.save(
    xr.Dataset(
        {
            # the flow into a constant pressure: with the capacitance it can drive any line
            "source_flow": ("time", source.flow, {"units": "m3/s"}),
            "pressure": (("channel", "time"), in_pipe.sensor_pressure, {"units": "Pa"}),
        },
        coords={
            "angle_deg": ("time", in_pipe.angle_deg),
            "channel": [sensor.name for sensor in rig.sensors],
        },
        attrs={
            "state": snakemake.wildcards.state,
            "speed_hz": recorded.speed_hz,
            "leak_area_m2": dict(params.leak_area),
            "source_capacitance_m3_pa": source.source_capacitance(pumping_hz),
            "source": f"lumped pump model and an uncalibrated pipe of {params.pipe_length} m",
        },
    ),
    snakemake.output[0],
)
