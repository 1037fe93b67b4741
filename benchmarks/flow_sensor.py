"""Errors of both virtual flow sensors on the paper's line, by frequency band.

    python benchmarks/flow_sensor.py

The true flow is that of the lumped pump with a worn slipper. The true pressure is the twin's with
the orifice at full amplitude; the sensors use a line with a linear orifice.
"""

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch

from rippletwin.flow_sensor import pinn
from rippletwin.flow_sensor.estimate import band_limit
from rippletwin.flow_sensor.line_response import line_factory
from rippletwin.flow_sensor.spectral_inversion import estimate_flow
from rippletwin.harmonics import one_period
from rippletwin.pump.faults import Slipper
from rippletwin.pump.outlets import ConstantPressure
from rippletwin.pump.simulation import simulate
from rippletwin.twin.twin import Twin

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))

from paper_rig import OIL, paper_rig

SPEED, PRESSURE, BAND, SAMPLES, WINDOWS = 1000 / 60, 9.484e6, 1500.0, 3072, 40
SENSORS = (2, 3)


def rig(sensors, wave_speed_factor=1.0):
    """The paper's calibrated line with two or three sensors."""
    nominal = paper_rig(sensors, third_sensor=4.6)
    line = (replace(s, wave_speed=s.wave_speed * wave_speed_factor) for s in nominal.line)
    return replace(nominal, line=tuple(line))


def main() -> None:
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    torch.set_num_threads(1)
    rng = np.random.default_rng(0)
    healthy, worn = (
        simulate({"pistons": 9}, OIL, 60 * SPEED, ConstantPressure(PRESSURE), fault)
        for fault in (None, Slipper(4e-7))
    )
    truth = band_limit(worn.flow, SPEED, BAND)
    orders = np.arange(1, SAMPLES // 2)
    print("| sensors | noise, kPa | wave speed | method | 0-0.5 kHz | 0.5-1 | 1-1.5 | all | ms |")
    print("|---|---|---|---|---|---|---|---|---|")
    for sensors in SENSORS:
        response = Twin(rig(sensors)).respond(worn, SPEED, PRESSURE, orders)
        clean = one_period(response, SAMPLES, orders)
        for factor in (1.0, 1.01):
            line_at = line_factory(Twin(rig(sensors, factor)), PRESSURE, healthy)
            started = time.perf_counter()
            trunk, _ = pinn.train(line_at, SPEED, BAND)
            trained = time.perf_counter() - started
            for noise in (0.0, 500.0, 4000.0):
                shape = (WINDOWS, sensors, SAMPLES)
                windows = clean + noise * rng.standard_normal(shape)
                for name, arguments in (("spectral", ()), ("PINN", (trunk,))):
                    run = pinn.estimate_flow if arguments else estimate_flow
                    started = time.perf_counter()
                    estimate = run(windows, SPEED, line_at, *arguments, max(noise, 50.0), BAND)
                    spent = (time.perf_counter() - started) / WINDOWS
                    cells = row(sensors, noise, factor, name, estimate.flow, truth)
                    print(f"{cells} {1e3 * spent:.1f} |")
            print(f"trunk trained in {trained:.0f} s", file=sys.stderr)


def row(sensors, noise, factor, name, flow, truth):
    """Cells of one method: errors of the flow in each band, relative rms."""
    wrong, right = np.fft.rfft(flow - truth), np.fft.rfft(truth)
    cells = []
    for low, high in ((1, 31), (31, 61), (61, 91), (1, 91)):
        error = np.sqrt(np.mean(np.sum(np.abs(wrong[:, low:high]) ** 2, axis=1)))
        cells.append(f"{100 * error / np.linalg.norm(right[low:high]):.1f} %")
    speed = "right" if factor == 1.0 else "1 % high"
    return f"| {sensors} | {noise / 1e3:g} | {speed} | {name} | " + " | ".join(cells) + " |"


if __name__ == "__main__":
    main()
