"""Measured, nominal and calibrated ripple at each sensor, one picture an operating point."""

from pathlib import Path

from job import open_log
from rippletwin import store
from rippletwin.figures import ripple
from rippletwin.figures.style import save

report_progress = open_log(snakemake)
ripples = store.load(snakemake.input.ripples)
folder = Path(snakemake.output[0])
folder.mkdir(parents=True, exist_ok=True)  # empty where no healthy recording is periodic
for label in ripples.point.values:
    point = ripples.sel(point=label)
    curves = {name: values.values for name, values in point.data_vars.items()}
    figure = ripple.plot_overlay(point.angle_deg.values, curves, point.channel.values, str(label))
    save(figure, folder / f"{label}.png", folder / f"{label}.svg")
report_progress(f"{ripples.sizes['point']} operating points")
