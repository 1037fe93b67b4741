"""HDF5 and MATLAB files whose claims are not to be believed: refused before anything is read."""

import tracemalloc

import h5py
import numpy as np
import pytest
import scipy.io

from case_folders import RATE, refused, ripple, spoilt
from rippletwin.case.load import load_case


def named(folder, name):
    """A good case whose recording has a name, and is not there yet."""
    spoilt(folder, lambda c: c["recordings"][0].update(file=name), pressure=None)
    return folder / name


def huge(file):
    file.create_dataset("pressure", (2, 10**12), "f8", chunks=(1, 1000))


def large(file):
    file.create_dataset("pressure", (2, 2 * 10**8), "f4", chunks=(1, 1000))


def pressure_group(file):
    file.create_group("pressure")["p1"] = ripple()[0]


def time_group(file):
    file["pressure"] = ripple()
    file.create_group("time_s")


def dangling_soft(file):
    file["pressure"] = h5py.SoftLink("/nowhere")


def looping_soft(file):
    file["pressure"] = h5py.SoftLink("/pressure")


def external(file):
    file["pressure"] = h5py.ExternalLink("other.h5", "/pressure")


def through_external(file):
    file["other"] = h5py.ExternalLink("other.h5", "/")
    file["pressure"] = h5py.SoftLink("/other/pressure")


def virtual(file):
    layout = h5py.VirtualLayout((2, 51200), "f8")
    layout[:] = h5py.VirtualSource("other.h5", "pressure", (2, 51200))
    file.create_virtual_dataset("pressure", layout)


def elsewhere(file):
    raw = [("raw.bin", 0, 2 * 51200 * 8)]
    file.create_dataset("pressure", (2, 51200), "f8", external=raw)


def no_values(file):
    file["pressure"] = h5py.Empty("f8")


def no_samples(file):
    file["pressure"] = np.zeros((2, 0))


def no_times(file):
    file["pressure"] = ripple()
    file["time_s"] = np.zeros(0)


def compound(file):
    file["pressure"] = np.zeros(5, dtype=[("p1", "f8"), ("p2", "f8")])


def complex_numbers(file):
    file["pressure"] = ripple() + 1j


def words(file):
    file["pressure"] = [["a", "b"], ["c", "d"]]


def three_dimensions(file):
    file["pressure"] = ripple()[None]


STRUCTURES = {
    "2e12 samples claimed": (huge, "pressure", ["the limit is 1 GiB"]),
    "4e8 samples claimed": (large, "pressure", ["2.98 GiB", "the limit is 1 GiB"]),
    "pressure is a group": (
        pressure_group,
        "pressure",
        ["a group that holds p1", "dataset: pressure/p1"],
    ),
    "time_s is a group": (time_group, "time_s", ["a group that holds nothing"]),
    "a dangling soft link": (dangling_soft, "pressure", ["leads nowhere"]),
    "a link to itself": (looping_soft, "pressure", ["to itself"]),
    "an external link": (external, "pressure", ["a link to another file"]),
    "a link through another file": (through_external, "pressure", ["another file"]),
    "a virtual dataset": (virtual, "pressure", ["data lie in another file"]),
    "data in a raw file": (elsewhere, "pressure", ["data lie in another file"]),
    "an empty dataspace": (no_values, "pressure", ["empty"]),
    "no samples": (no_samples, "pressure", ["empty"]),
    "no times": (no_times, "time_s", ["empty"]),
    "a compound type": (compound, "pressure", ["a structure of p1, p2"]),
    "complex numbers": (complex_numbers, "pressure", ["complex numbers"]),
    "words": (words, "pressure", ["not all numbers"]),
    "three dimensions": (three_dimensions, "pressure", ["shape (1, 2, 51200)"]),
}


@pytest.mark.parametrize("name", STRUCTURES)
def test_structure_that_is_no_recording(tmp_path, name):
    """Refused with little memory: shape, type and links are asked before data are read.

    The other file that links lead to exists and holds a good recording: it must not be followed.
    """
    make, field, words = STRUCTURES[name]
    path = named(tmp_path, "r.h5")
    for other, fill in (("other.h5", None), ("r.h5", make)):
        with h5py.File(tmp_path / other, "w") as file:
            if fill is None:
                file["pressure"] = ripple()
            else:
                fill(file)
            file.attrs["sampling_rate_hz"] = RATE
    ripple()[0].tofile(tmp_path / "raw.bin")
    tracemalloc.start()
    try:
        refused(tmp_path, path.name, field, *words)
        assert tracemalloc.get_traced_memory()[1] < 20e6
    finally:
        tracemalloc.stop()


ATTRIBUTES = {
    "rate as text": ("sampling_rate_hz", "51200 Hz", "sampling_rate_hz", ["is text"]),
    "rate as bytes": ("sampling_rate_hz", np.bytes_(b"51200"), "sampling_rate_hz", ["is text"]),
    "two rates": ("sampling_rate_hz", [RATE, RATE], "sampling_rate_hz", ["2 values"]),
    "no rate": ("sampling_rate_hz", h5py.Empty("f8"), "sampling_rate_hz", []),
    "rate of zero": ("sampling_rate_hz", 0.0, "sampling_rate_hz", ["0 Hz"]),
    "rate that is no number": ("sampling_rate_hz", np.nan, "sampling_rate_hz", ["nan Hz"]),
    "rate of no recorder": ("sampling_rate_hz", 1e12, "sampling_rate_hz", ["implausible samp"]),
    "rate in kHz": ("sampling_rate_hz", 51.2, "sampling_rate_hz", ["looks like kHz"]),
    "rate below the pistons": ("sampling_rate_hz", 300.0, "sampling_rate_hz", ["too low"]),
    "three names for two rows": ("sensors", ["p1", "p2", "p3"], "sensors", ["2 channel(s)"]),
    "a name twice": ("sensors", ["p1", "p1"], "sensors", ["p1, p1"]),
    "other letters": ("sensors", ["P1", "p2"], "p1", ["Did you mean P1?"]),
}


@pytest.mark.parametrize("name", ATTRIBUTES)
def test_attribute_that_is_wrong(tmp_path, name):
    """The attribute is named, with what it holds."""
    attribute, value, field, words = ATTRIBUTES[name]
    path = named(tmp_path, "r.h5")
    with h5py.File(path, "w") as file:
        file["pressure"] = ripple()
        file.attrs["sampling_rate_hz"] = RATE
        file["pressure"].attrs[attribute] = value
    refused(tmp_path, "r.h5", field, *words)


def test_a_link_within_the_file_is_followed(tmp_path):
    """A soft link to a dataset of the same file is that dataset."""
    path = named(tmp_path, "r.h5")
    with h5py.File(path, "w") as file:
        file["run/raw"] = ripple()
        file["pressure"] = h5py.SoftLink("/run/raw")
        file.attrs["sampling_rate_hz"] = RATE
    assert load_case(tmp_path).recordings[0].pressure.shape == (2, 51200)


MATLAB = {
    "a struct": (
        {"rec": {"pressure": ripple(0.3), "sampling_rate_hz": RATE}},
        "pressure",
        ["rec.pressure", "dataset: rec.pressure"],
    ),
    "rate as text": (
        {"pressure": ripple(0.3), "sampling_rate_hz": "51200"},
        "sampling_rate_hz",
        ["not all numbers"],
    ),
    "two rates": (
        {"pressure": ripple(0.3), "sampling_rate_hz": [RATE, RATE]},
        "sampling_rate_hz",
        ["2 values"],
    ),
    "no rate": ({"pressure": ripple(0.3), "sampling_rate_hz": []}, "sampling_rate_hz", ["empty"]),
    "complex": ({"pressure": ripple(0.3) + 1j}, "pressure", ["complex numbers"]),
    "other letters": ({"P1": [1.0], "p2": [1.0]}, "p1", ["Did you mean P1?"]),
    "cells": ({"pressure": np.array([1.0, "a"], dtype=object)}, "pressure", ["not all numbers"]),
}


@pytest.mark.parametrize("name", MATLAB)
def test_matlab_variable_that_is_wrong(tmp_path, name):
    """The variable is named, with what it holds; a struct with the key that reads its field."""
    content, field, words = MATLAB[name]
    path = named(tmp_path, "r.mat")
    scipy.io.savemat(path, content)
    refused(tmp_path, "r.mat", field, *words)


def test_matlab_73_struct(tmp_path):
    """A struct of a v7.3 file is an HDF5 group."""
    path = named(tmp_path, "r.mat")
    with h5py.File(path, "w") as file:
        file["rec/pressure"] = ripple(0.3).T
    refused(tmp_path, "r.mat", "pressure", "dataset: rec.pressure")


def test_matlab_claim_of_too_many_samples(tmp_path):
    """The header's claim of 2 x 2e8 doubles is refused before memory is asked for."""
    path = named(tmp_path, "r.mat")
    scipy.io.savemat(path, {"pressure": np.zeros((2, 1000)), "sampling_rate_hz": RATE})
    raw = bytearray(path.read_bytes())
    at = raw.index(np.array([2, 1000], dtype="<i4").tobytes())
    raw[at : at + 8] = np.array([2, 2 * 10**8], dtype="<i4").tobytes()
    path.write_bytes(raw)
    tracemalloc.start()
    try:
        refused(tmp_path, "r.mat", "pressure", "the limit is 1 GiB")
        assert tracemalloc.get_traced_memory()[1] < 20e6
    finally:
        tracemalloc.stop()
