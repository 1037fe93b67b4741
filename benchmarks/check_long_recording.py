"""Time and memory of `rippletwin check` on one long recording.

    python benchmarks/check_long_recording.py [--minutes 10] [--rate 51200] [--sensors 2]

A recording of piston harmonics with noise, whose speed wanders by 0.1 %, is written as HDF5 in
single precision. `check` then runs in a process of its own; its wall time, its CPU time and the
largest resident memory that the kernel counted for it are printed.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import h5py
import numpy as np
import yaml

from measured_command import run_measured

SPEED_HZ, PISTONS, HARMONICS = 1000 / 60, 9, 24
BLOCK = 2**20  # samples written at once


def sheet(sensors: int) -> dict:
    """The case's rig.yaml."""
    return {
        "fluid": {"density": 870.0, "kinematic_viscosity": 3.2e-5},
        "pump": {"pistons": PISTONS},
        "line": {"segments": [{"length": 8.95, "diameter": 0.0197, "wave_speed": 1020.0}]},
        "sensors": [{"name": f"p{k + 1}", "position": 0.4 + 2.1 * k} for k in range(sensors)],
        "load": {"kind": "orifice"},
        "recordings": [
            {
                "file": "long.h5",
                "state": "healthy",
                "speed_rpm": 60 * SPEED_HZ,
                "load_pressure": 9.5e6,
            }
        ],
    }


def write_recording(path: Path, samples: int, rate: float, sensors: int) -> None:
    """Write the recording in blocks."""
    rng = np.random.default_rng(0)
    order = PISTONS * np.arange(1, HARMONICS + 1)
    size = 2e5 * rng.normal(size=(2, sensors, HARMONICS)) / np.sqrt(np.arange(1, HARMONICS + 1))
    with h5py.File(path, "w") as file:
        data = file.create_dataset("pressure", (sensors, samples), "f4", chunks=(1, 2**16))
        data.attrs["sampling_rate_hz"] = rate
        for start in range(0, samples, BLOCK):
            seconds = (start + np.arange(min(BLOCK, samples - start))) / rate
            turn = SPEED_HZ * seconds + 1e-3 * SPEED_HZ / 0.3 * np.sin(0.3 * seconds)
            wave = np.exp(2j * np.pi * PISTONS * turn)
            power, total = np.ones_like(wave), np.zeros((sensors, len(wave)))
            for k in range(len(order)):
                power = power * wave
                total += ((size[0, :, k] + 1j * size[1, :, k])[:, None] * power).real
            noise = 1e3 * rng.normal(size=total.shape)
            data[:, start : start + len(seconds)] = 9.5e6 + total + noise


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--rate", type=float, default=51200.0)
    parser.add_argument("--sensors", type=int, default=2)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        case = Path(folder)
        samples = int(60 * options.minutes * options.rate)
        write_recording(case / "long.h5", samples, options.rate, options.sensors)
        (case / "rig.yaml").write_text(yaml.safe_dump(sheet(options.sensors)))
        taken = run_measured([sys.executable, "-m", "rippletwin", "check", folder])
    print(f"{taken.wall_s:.1f} s, CPU {taken.cpu_s:.1f} s, {taken.peak_kib / 1e6:.2f} GB")
    sys.exit(taken.returncode)


if __name__ == "__main__":
    main()
