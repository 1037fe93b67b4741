"""PTSNET and TSNet close a valve; run by the Python that has them (they need NumPy 1).

    PYTHON network_programs.py PROGRAM CELLS STEPS

A frictionless-smooth pipe of LENGTH leads from a reservoir to a valve that closes within a step.
Prints JSON: processor seconds of the steps after a run that compiles, head (m) at the valve,
flow (m3/s) before, wave speed (m/s), the program's version.
"""

from __future__ import annotations

import json
import sys
import time
from contextlib import redirect_stdout
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory

LENGTH, DIAMETER, WAVE_SPEED, HEAD = 1000.0, 0.5, 1438.656, 200.0  # m, m, m/s, m
SHEET = """[JUNCTIONS]
 VALVE_IN 0 0
[RESERVOIRS]
 SOURCE {head}
 SINK 0
[PIPES]
 PIPE SOURCE VALVE_IN {length} {diameter} 140 0 Open
[VALVES]
 VALVE VALVE_IN SINK {diameter} TCV 1e6 0
[OPTIONS]
 Units LPS
 Headloss H-W
 Accuracy 1e-8
[TIMES]
 Duration 0
[END]
"""


def ptsnet(sheet: str, cells: int, steps: int) -> dict:
    """One run of PTSNET, built anew; the steps alone are timed."""
    import numpy as np
    from ptsnet.simulation.sim import PTSNETSimulation

    dt = LENGTH / WAVE_SPEED / cells
    settings = {
        "time_step": dt,
        "duration": steps * dt,
        "default_wave_speed": WAVE_SPEED,
        "wave_speed_method": "user",
        "save_results": False,
        "skip_compatibility_check": True,
    }
    simulation = PTSNETSimulation("closure", sheet, settings)
    flow = float(simulation.ss["pipe"].flowrate[0])
    closing = np.array([0.5, 1.5, 2.5]) * dt
    simulation.define_valve_settings("VALVE", closing, np.array([1.0, 0.0, 0.0]))
    start = time.process_time()
    simulation.run()
    seconds = time.process_time() - start
    head = simulation["node"].head["VALVE_IN"]
    return {"seconds": seconds, "head": list(map(float, head)), "flow": flow}


def tsnet(sheet: str, cells: int, steps: int) -> dict:
    """One run of TSNet, built anew; its simulator alone is timed."""
    import tsnet as program

    dt = LENGTH / WAVE_SPEED / cells
    model = program.network.TransientModel(sheet)
    model.set_wavespeed(WAVE_SPEED)
    model.set_time(steps * dt, dt)
    model.valve_closure("VALVE", [dt, 0.0, 0.0, 1])
    model = program.simulation.Initializer(model, 0.0, "DD")
    pipe = model.get_link("PIPE")
    flow = float(pipe.initial_velocity[0] * pipe.area)
    start = time.process_time()
    model = program.simulation.MOCSimulator(model, "results", "steady")
    seconds = time.process_time() - start
    head = model.get_node("VALVE_IN").head
    return {
        "seconds": seconds,
        "head": list(map(float, head)),
        "flow": flow,
        "cells": int(pipe.number_of_segments),
    }


def main() -> None:
    program, cells, steps = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    run = {"ptsnet": ptsnet, "tsnet": tsnet}[program]
    with TemporaryDirectory() as folder, redirect_stdout(sys.stderr):
        import os

        os.chdir(folder)
        sheet = Path("pipe.inp")
        sheet.write_text(SHEET.format(head=HEAD, length=LENGTH, diameter=1e3 * DIAMETER))
        run(str(sheet), 20, 40)
        result = run(str(sheet), cells, steps)
    print(json.dumps(result | {"version": version(program), "wave_speed": WAVE_SPEED}))


if __name__ == "__main__":
    main()
