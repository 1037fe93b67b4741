"""Recordings written as a recorder would, and read by what rig.yaml says of them."""

import h5py
import numpy as np
import pytest

from case_folders import RATE, ripple, sheet, write_case
from rippletwin.case.load import load_case

PRESSURE = ripple(0.3)  # (2, N): p1 and p2
OTHERS = np.array([np.zeros(PRESSURE.shape[1]), 7 * PRESSURE[0]])  # channels that nobody wants
ALL = np.array([OTHERS[0], PRESSURE[1], OTHERS[1], PRESSURE[0]])
NUMBERED = {"channels": {"p1": 4, "p2": 2}}
TIME = np.arange(PRESSURE.shape[1]) / RATE


def read(folder, name, write, **entry):
    """The recording `name`, made by `write(path)`, as a case reads it."""
    content = sheet()
    content["recordings"][0].update(file=name, **entry)
    write_case(folder, content, pressure=None)
    write(folder / name)
    return load_case(folder).recordings[0]


def same(recording, relative=1e-9):
    np.testing.assert_allclose(recording.pressure, PRESSURE, rtol=relative)
    assert recording.sampling_rate_hz == pytest.approx(RATE, rel=1e-5)  # 6 digits in some files


def hdf5(fill):
    def write(path):
        with h5py.File(path, "w") as file:
            fill(file)

    return write


def duct_like(file):
    """As the recorder of the measured duct writes: samples by channels, another attribute."""
    file["time_data"] = ALL.T
    file["time_data"].attrs["sample_freq"] = RATE
