"""Outlet flow of the pump in one state, coupled to an uncalibrated pipe, and the pressure in it.

A state such as S+C1 is several faults together, all from the same piston on.
"""

from pathlib import Path

import numpy as np
import xarray as xr

from job import start
from rippletwin import store
from rippletwin.case.load import load_case
from rippletwin.case.model import Segment
from rippletwin.pump.faults import Cylinder, Slipper
from rippletwin.pump.outlets import ConstantPressure, Pipe
from rippletwin.pump.simulation import simulate

tell = start(snakemake)
params, state = snakemake.params, snakemake.wildcards.state
rig = load_case(Path(snakemake.input.rig).parent, states=()).rig
recorded = store.load(snakemake.input.recordings)
first = rig.line[0]
pipe = Segment(params.pipe_length, first.diameter, first.wave_speed)
positions = tuple(sensor.position for sensor in rig.sensors)
behind = rig.load.back_pressure


def ripple(outlet, fault=None):
    speed_rpm, samples = 60 * recorded.speed_hz, recorded.sizes["time"]
    return simulate(rig.pump, rig.fluid, speed_rpm, outlet, fault, samples)


kinds = {"S": Slipper, "C1": Cylinder, "C2": Cylinder}
fault = [
    kinds[name](area)
    for name, area in zip(state.split("+"), np.atleast_1d(params.leak_area))
    if name in kinds
]
# A faulty pump meets the orifice that the healthy one left.
result = healthy = ripple(
    Pipe(pipe, positions, load_pressure=recorded.load_pressure, back_pressure=behind)
)
if fault:
    result = ripple(Pipe(pipe, positions, orifice=healthy.orifice, back_pressure=behind), fault)
# What any line can be driven with: the flow into a constant pressure, and the chambers beside it.
source = ripple(ConstantPressure(recorded.load_pressure), fault)
pumping_hz = rig.pump["pistons"] * recorded.speed_hz
tell(f"mean flow {result.flow.mean():.4g} m3/s, periodic to {result.change:.1g}")
store.save(
    xr.Dataset(
        {
            "flow": (("channel_q", "time"), result.flow[None], {"units": "m3/s"}),
            "source_flow": ("time", source.flow, {"units": "m3/s"}),
            "pressure": (("channel", "time"), result.sensor_pressure, {"units": "Pa"}),
        },
        coords={
            "angle_deg": ("time", result.angle_deg),
            "channel": [sensor.name for sensor in rig.sensors],
            "channel_q": ["outlet"],
        },
        attrs={
            "state": state,
            "speed_hz": recorded.speed_hz,
            "leak_area_m2": params.leak_area,
            "source_capacitance_m3_pa": source.source_capacitance(pumping_hz),
            "source": f"lumped pump model and an uncalibrated pipe of {params.pipe_length} m",
        },
    ),
    snakemake.output[0],
)
