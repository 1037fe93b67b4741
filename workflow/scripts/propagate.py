"""Pressure at the sensors of the twin's line, driven by the pump in one state."""

import xarray as xr

from job import open_log
from rippletwin import store
from rippletwin.errors import InputError
from rippletwin.twin.propagation import propagate, pump_change
from rippletwin.twin.twin_file import load_twin

report_progress = open_log(snakemake)
params = snakemake.params
recorded = store.load(snakemake.input.recordings)
fault, healthy = store.load(snakemake.input.flow), store.load(snakemake.input.healthy)
twin = load_twin(snakemake.input.twin, snakemake.input.effects)
flow, healthy_flow = fault.source_flow.values, healthy.source_flow.values
point = recorded.speed_hz, recorded.load_pressure
result = propagate(
    twin,
    flow,
    healthy_flow,
    *point,
    fault.source_capacitance_m3_pa,
    params.steps,
    params.tolerance,
)
report_progress(
    f"{result.periods} revolutions to a change of {result.change:.1g}, "
    f"largest at {result.worst_position:.2f} m"
)
if not result.converged:
    raise InputError(
        "config",
        "propagation.tolerance",
        f"{params.tolerance:g}: after {result.periods} revolutions the line still changes by "
        f"{result.change:.1g} of its ripple from one to the next",
        "Raise it, or check in rig.yaml what damps the line: load and viscosity",
    )
store.save(
    xr.Dataset(
        {
            "pressure": (("channel", "time"), result.pressure, {"units": "Pa"}),
            # What drove the line: the pump as the twin knows it.
            "source_flow": (
                "time",
                flow + pump_change(twin, healthy_flow, *point)[0],
                {"units": "m3/s"},
            ),
        },
        coords={"channel": recorded.channel.values},
        attrs={
            "state": snakemake.wildcards.state,
            "speed_hz": recorded.speed_hz,
            "source": f"the {snakemake.wildcards.twin} line by the method of characteristics",
        },
    ),
    snakemake.output[0],
)
