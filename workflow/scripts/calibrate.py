"""The calibrated twin, its report, and the ripples to draw."""

from pathlib import Path

import numpy as np
import xarray as xr

from job import open_log
from rippletwin import store
from rippletwin.calibration import report
from rippletwin.calibration.calibrate import Settings, calibrate
from rippletwin.calibration.calibrate_case import observe_healthy
from rippletwin.calibration.pareto import calibrate_pareto
from rippletwin.case.load import load_case
from rippletwin.twin.twin import Twin

report_progress = open_log(snakemake)
params = snakemake.params
case = load_case(Path(snakemake.input.rig).parent, states={"healthy"})
observations = observe_healthy(case)
twin = Twin(case.rig, observations, friction=params.friction)
settings = Settings(max_frequency_hz=params.max_frequency_hz)
if params.method == "pareto":
    calibration = calibrate_pareto(
        twin, observations, settings, progress=report_progress
    ).calibration
else:
    calibration = calibrate(twin, observations, settings, progress=report_progress)
for warning in calibration.warnings:
    report_progress(f"warning: {warning}")
report_progress(
    f"relative misfit {calibration.before.relative:.1%} -> {calibration.after.relative:.1%}, "
    f"Theil {calibration.before.theil:.3f} -> {calibration.after.theil:.3f}"
)

# None where no healthy recording is periodic: the store is then empty along `point`.
ripples = report.compute_ripples(calibration, observations)
sensors = [sensor.name for sensor in case.rig.sensors]
dims, shape = ("point", "channel", "time"), (len(ripples), len(sensors), len(report.RIPPLE_DEG))
store.save(
    xr.Dataset(
        {
            name: (dims, np.reshape([r[name] for r in ripples], shape), {"units": "Pa"})
            for name in ("measured", "nominal", "calibrated")
        },
        coords={
            "point": [r["label"] for r in ripples],
            "channel": sensors,
            "angle_deg": ("time", report.RIPPLE_DEG, {"units": "degrees"}),
        },
        attrs={"source": "piston harmonics of healthy recordings"},
    ),
    snakemake.output.ripples,
)
report.save(calibration, Path(snakemake.output.twin).parent)
