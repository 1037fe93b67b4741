"""Small case folders for tests, good until a test spoils them."""

import h5py
import numpy as np
import pytest
import yaml

from rippletwin.case.load import load_case
from rippletwin.errors import InputError

RATE = 51200.0


def sheet():
    """A complete, valid sheet of one recording, as the dictionary that rig.yaml holds."""
    return {
        "fluid": {"density": 870.0, "kinematic_viscosity": 3.2e-5},
        "pump": {"pistons": 9},
        "line": {
            "segments": [
                {"length": 5.95, "diameter": 0.0197, "wave_speed": 1020.0},
                {"length": 3.0, "diameter": 0.0197, "wave_speed": 1000.0},
            ]
        },
        "sensors": [{"name": "p1", "position": 0.42}, {"name": "p2", "position": 2.59}],
        "load": {"kind": "orifice"},
        "recordings": [
            {
                "file": "healthy_0.h5",
                "state": "healthy",
                "speed_rpm": 1000.0,
                "load_pressure": 9.5e6,
            }
        ],
    }


def ripple(seconds=1.0, speed_hz=1000 / 60):
    """Five piston harmonics on 9.5 MPa with 1 kPa of noise, (2, N), Pa."""
    time = np.arange(int(seconds * RATE)) / RATE
    harmonics = 9 * np.arange(1, 6)
    phase = 2 * np.pi * speed_hz * harmonics[:, None] * time
    weights = 3e5 / harmonics**0.5 / 3
    noise = np.random.default_rng(0).normal(scale=1e3, size=(2, time.size))
    return 9.5e6 + np.array([weights @ np.cos(phase), 0.7 * weights @ np.cos(phase + 1)]) + noise


def write_hdf5(path, pressure):
    with h5py.File(path, "w") as file:
        file["pressure"] = pressure
        file["pressure"].attrs["sampling_rate_hz"] = RATE


def write_case(folder, content, pressure="ripple"):
    """Write rig.yaml and, unless `pressure` is None, the first recording as HDF5."""
    (folder / "rig.yaml").write_text(yaml.safe_dump(content))
    if pressure is not None:
        pressure = ripple() if isinstance(pressure, str) else pressure
        write_hdf5(folder / content["recordings"][0]["file"], pressure)


def spoilt(folder, spoil, pressure="ripple"):
    """A case whose sheet `spoil` has changed."""
    content = sheet()
    spoil(content)
    write_case(folder, content, pressure)


def refused(folder, file, field, *words):
    """Load `folder`; the only error must name `file` and `field` and say `words`, with a remedy.

    Returns the error.
    """
    error, *others = errors_of(folder)
    assert not others, others
    return told(error, file, field, *words)


def errors_of(folder):
    """What is told of a case that is refused."""
    with pytest.raises(InputError) as caught:
        load_case(folder)
    return caught.value.errors


def told(error, file, field, *words):
    """`error`, which must name `file` and `field` and say `words`, with a remedy."""
    assert error.file.endswith(file), error
    assert error.field == field, error
    assert error.remedy, error
    for word in words:
        assert word in str(error), error
    return error
