"""A small run of the real workflow: one sensor, one pipe, one network, one leaking slipper."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import h5py
import numpy as np
import yaml

from leaking_pump import LOAD, OIL, SHEET, SPEED
from paths import ROOT
from rippletwin.case.model import Segment
from rippletwin.pump.faults import Slipper
from rippletwin.pump.outlets import ConstantPressure, Pipe
from rippletwin.pump.simulation import simulate

PIPE = Segment(2.0, 0.02, 1200.0)
SENSOR_AT = 0.4  # m
SAMPLES, REVOLUTIONS = 384, 20  # of a recording: samples a revolution, revolutions
NOISE = 2e3  # Pa
SLIPPER = Slipper(6e-7)

OVERLAY = """\
results: out
case: case
datasets: [experimental]
seeds: 1
windows: {per_recording: 12, samples_per_revolution: 1536}
faults: {pipe_length: 2.0}
propagation: {steps_per_revolution: 1536}
samples_per_class: {time: 10, image: 10, randomised: 2}
architectures: [cnn1d_341_100]
training: {plain: {max_epochs: 1}}
"""
EVERY_STAGE = ("out/report.html", "out/calibration/twin.json", "out/propagated/calibrated/H.zarr")
"""Targets for which ten jobs run: calibrate, explain, diagnose, simulate, propagate, train,
evaluate, and what these need and feed."""


def write_case(folder: Path, state: str = "slipper") -> None:
    """rig.yaml, the healthy pump's flow ripple, and recordings of the healthy pump and of one with
    a leaking slipper, in `folder`.

    state : what rig.yaml says of the second recording.
    """
    folder.mkdir()
    point = {"speed_rpm": SPEED, "load_pressure": LOAD}
    sheet = {
        "fluid": {"density": OIL.density, "kinematic_viscosity": OIL.kinematic_viscosity},
        "pump": {"pistons": SHEET["pistons"]},
        "line": {
            "segments": [
                {
                    "length": PIPE.length,
                    "diameter": PIPE.diameter,
                    "wave_speed": PIPE.wave_speed,
                }
            ]
        },
        "sensors": [{"name": "p1", "position": SENSOR_AT}],
        "load": {"kind": "orifice"},
        "recordings": [
            {"file": "healthy.h5", "state": "healthy", "flow_ripple": "flow.csv"} | point,
            {"file": "slipper.h5", "state": state} | point,
        ],
    }
    (folder / "rig.yaml").write_text(yaml.safe_dump(sheet))
    source = simulate(SHEET, OIL, SPEED, ConstantPressure(LOAD))
    table = np.column_stack([source.angle_deg, source.flow])
    np.savetxt(folder / "flow.csv", table, "%.9g", ",", header="angle_deg,flow_m3_s", comments="")
    rng = np.random.default_rng(0)
    for name, fault in (("healthy", None), ("slipper", SLIPPER)):
        pipe = Pipe(PIPE, (SENSOR_AT,), load_pressure=LOAD)
        run = simulate(
            SHEET, OIL, SPEED, pipe, fault, samples_per_revolution=SAMPLES, min_steps=3072
        )
        pressure = np.tile(run.sensor_pressure, REVOLUTIONS)
        with h5py.File(folder / f"{name}.h5", "w") as file:
            file["pressure"] = pressure + rng.normal(scale=NOISE, size=pressure.shape)
            file["pressure"].attrs["sampling_rate_hz"] = SAMPLES * SPEED / 60.0


def start(
    folder: Path,
    targets: tuple[str, ...],
    *options: str,
    profile: str = "default",
    environment: Mapping[str, str] = os.environ,
    **streams,
) -> subprocess.Popen:
    """Snakemake in `folder`, the leader of a process group of its own, with a profile of the
    repository and the configuration `folder`/small.yaml over config/smoke.yaml."""
    configuration = ("--configfile", str(ROOT / "config" / "smoke.yaml"), "small.yaml")
    command = [
        sys.executable, "-m", "snakemake", *targets, "--snakefile", str(ROOT / "Snakefile"),
        "--workflow-profile", str(ROOT / "profiles" / profile), "--cores", "2", *configuration,
        *options,
    ]  # fmt: skip
    search = os.pathsep.join(filter(None, [str(ROOT / "src"), environment.get("PYTHONPATH")]))
    return subprocess.Popen(
        command, cwd=folder, env={**environment, "PYTHONPATH": search}, start_new_session=True,
        **streams,
    )  # fmt: skip
