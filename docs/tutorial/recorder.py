"""Stand in for a data recorder: files in bar with columns, as recorders export them.

    python docs/tutorial/recorder.py my_case own_rig/recordings

Reads the bench's recordings of `my_case` and writes healthy_1000.csv, healthy_1200.csv and
monday.csv. The last is of a worn slipper; nobody told the person at the bench.
"""

from __future__ import annotations

import sys
from pathlib import Path

import h5py
import numpy as np

FILES = {
    "healthy_1000_95": "healthy_1000",
    "healthy_1200_60": "healthy_1200",
    "slipper_1000_95": "monday",
}
BAR = 1e5  # Pa


def main(case: str, folder: str) -> None:
    Path(folder).mkdir(parents=True, exist_ok=True)
    for recorded, exported in FILES.items():
        with h5py.File(f"{case}/recordings/{recorded}.h5") as file:
            pressure = file["pressure"][:] / BAR
            time = np.arange(pressure.shape[1]) / file["pressure"].attrs["sampling_rate_hz"]
        np.savetxt(
            f"{folder}/{exported}.csv",
            np.column_stack([time, *pressure]),
            delimiter=",",
            header=",".join(["time_s", *(f"p{k}" for k in range(1, len(pressure) + 1))]),
            comments="",
            fmt=["%.7f"] + ["%.5f"] * len(pressure),
        )


if __name__ == "__main__":
    main(*sys.argv[1:])
