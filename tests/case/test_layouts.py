"""Files as recorders write them are read by what rig.yaml says of them: the pressures that come in
are those that were written."""

import shutil
import struct
import sys

import h5py
import numpy as np
import pytest
import pyuff
import scipy.io
from nptdms import ChannelObject, TdmsWriter
from scipy.io import wavfile

from case_folders import RATE, refused, sheet, write_case
from paths import MEASURED, ROOT
from recorder_files import ALL, NUMBERED, OTHERS, PRESSURE, TIME, duct_like, hdf5, read, same
from rippletwin.case.load import load_case
from rippletwin.case.readers import wav
from rippletwin.case.readers.layout import Layout


def in_groups(file):
    file["run/raw"] = ALL
    file["run"].attrs["fs"] = RATE
    file["run/clock"] = TIME


def vectors(file):
    file["daq/in0"], file["daq/in1"] = PRESSURE
    file["fs"] = RATE


def vectors_with_times(file):
    file["run/p1"], file["run/p2"] = PRESSURE
    file["run/time_s"] = TIME


def vectors_with_rates(file):
    file["p1"], file["p2"] = PRESSURE
    for name in ("p1", "p2"):
        file[name].attrs["sampling_rate_hz"] = RATE


IN_RUN = {"channels": {"p1": "run/p1", "p2": "run/p2"}}


def named_rows(file):
    file["pressure"] = ALL
    file["pressure"].attrs.update(sampling_rate_hz=RATE, sensors=["a", "out", "b", "in"])


HDF5 = {
    "the duct's": (
        duct_like,
        {"dataset": "time_data", "sampling_rate_name": "sample_freq", **NUMBERED},
    ),
    "in a group": (in_groups, {"dataset": "run/raw", "sampling_rate_name": "fs", **NUMBERED}),
    "times": (in_groups, {"dataset": "run/raw", "time": "clock", **NUMBERED}),
    "vectors": (
        vectors,
        {"channels": {"p1": "daq/in0", "p2": "daq/in1"}, "sampling_rate_name": "fs"},
    ),
    "vectors beside their times": (vectors_with_times, IN_RUN),
    "vectors with a rate": (vectors_with_rates, {}),
    "rows by name": (named_rows, {"channels": {"p1": "in", "p2": "out"}}),
    "samples by sensors": (
        lambda file: (
            file.update({"pressure": PRESSURE.T}) or file.attrs.update(sampling_rate_hz=RATE)
        ),
        {},
    ),
}


@pytest.mark.parametrize("name", HDF5)
def test_hdf5_as_rig_yaml_describes_it(tmp_path, name):
    """Another name, another orientation, more channels, another attribute: the same pressures."""
    fill, entry = HDF5[name]
    same(read(tmp_path, "r.h5", hdf5(fill), **entry))


def test_only_the_sensors_channels_are_read(tmp_path):
    """All 16000 channels would need 1.8 GiB, more than is read; the two that are asked for need
    none of it."""

    def wide(file):
        shape = (PRESSURE.shape[1], 16000)
        data = file.create_dataset("all", shape, "f8", chunks=(shape[0], 1))
        data[:, 15999], data[:, 2] = PRESSURE
        file.attrs["sampling_rate_hz"] = RATE

    entry = {"dataset": "all", "orientation": "samples_by_sensors"}
    same(read(tmp_path, "r.h5", hdf5(wide), channels={"p1": 16000, "p2": 3}, **entry))


def test_a_stated_orientation_is_believed(tmp_path):
    """Told that the first dimension counts samples, two samples of many channels are read as such:
    the shape alone would say the opposite."""
    with pytest.raises(ValueError, match="revolutions"):
        read(
            tmp_path,
            "r.h5",
            hdf5(lambda file: file.update({"pressure": PRESSURE})),
            orientation="samples_by_sensors",
            sampling_rate_hz=RATE,
            channels={"p1": 1, "p2": 2},
        )


def matlab(path):
    scipy.io.savemat(path, {"rec": {"y": ALL.T, "fs": RATE}, "note": "x"})


def matlab73(path):
    with h5py.File(path, "w", userblock_size=512) as file:
        file["rec/y"], file["rec/fs"] = ALL, [[RATE]]
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


@pytest.mark.parametrize("write", [matlab, matlab73])
def test_matlab_struct_as_rig_yaml_describes_it(tmp_path, write):
    """A field of a struct, with the sampling rate beside it, in either version of the format."""
    same(read(tmp_path, "r.mat", write, dataset="rec.y", sampling_rate_name="fs", **NUMBERED))


@pytest.mark.parametrize("write", [matlab, matlab73])
def test_orientation_is_that_of_matlab_s_array(tmp_path, write):
    """MATLAB shows samples by sensors in either version of the format, though a file of v7.3 holds
    the dimensions in reverse order: it is read when told so, and the other way round in vain."""
    entry = {"dataset": "rec.y", "sampling_rate_name": "fs", **NUMBERED}
    same(read(tmp_path, "r.mat", write, orientation="samples_by_sensors", **entry))
    with pytest.raises(ValueError, match="revolutions"):
        read(tmp_path, "r.mat", write, orientation="sensors_by_samples", **entry)


def test_zarr(tmp_path):
    """A store is a folder; its array is named as in HDF5."""
    import zarr

    def write(path):
        store = zarr.open_group(path, mode="w")
        store.create_array("run/raw", data=ALL)
        store.attrs["fs"] = RATE

    recording = read(
        tmp_path, "r.zarr", write, dataset="run/raw", sampling_rate_name="fs", **NUMBERED
    )
    same(recording)


def test_zarr_of_vectors_whose_group_has_the_rate(tmp_path):
    """One array for each sensor, in a group that states the sampling rate."""
    import zarr

    def write(path):
        group = zarr.open_group(path, mode="w").create_group("run")
        for name, row in zip(("p1", "p2"), PRESSURE):
            group.create_array(name, data=row)
        group.attrs["sampling_rate_hz"] = RATE

    same(read(tmp_path, "r.zarr", write, **IN_RUN))


def tdms(path):
    properties = {"rate": RATE}
    with TdmsWriter(path) as writer:
        for group in ("old", "new"):
            rows = PRESSURE if group == "new" else 2 * PRESSURE
            writer.write_segment(
                [ChannelObject(group, n, r, properties) for n, r in zip(("a1", "a2"), rows)]
            )


def test_tdms_as_rig_yaml_describes_it(tmp_path):
    """The group, the channels' names and the rate's property are stated; another group is left."""
    channels = {"p1": "a1", "p2": 2}
    same(
        read(
            tmp_path,
            "r.tdms",
            tdms,
            dataset="new",
            channels=channels,
            sampling_rate_name="rate",
        )
    )


def test_tdms_channels_of_two_lengths_are_refused(tmp_path):
    """A sample less of the second sensor: nothing says which sample is missing."""
    content = sheet()
    content["recordings"][0]["file"] = "r.tdms"
    write_case(tmp_path, content, None)
    with TdmsWriter(tmp_path / "r.tdms") as writer:
        for name, row in (("p1", PRESSURE[0]), ("p2", PRESSURE[1][:-1])):
            writer.write_segment([ChannelObject("g", name, row, {"wf_increment": 1 / RATE})])
    size = len(PRESSURE[0])
    refused(tmp_path, "r.tdms", "channels", f"lengths differ: p1 {size}, p2 {size - 1}")


COUNT = 600.0  # Pa


def wav_bytes(data, channels, bits, valid_bits=None):
    """A WAV file of whole numbers, of an extensible format where its valid bits are stated."""
    rate, block = int(RATE), channels * bits // 8
    head = struct.pack("<HHIIHH", 1, channels, rate, rate * block, block, bits)
    if valid_bits is not None:
        guid = bytes.fromhex("0100000000001000800000aa00389b71")
        head = struct.pack("<H", 0xFFFE) + head[2:]
        head += struct.pack("<HHI", 22, valid_bits, 0) + guid
    body = b"WAVEfmt " + struct.pack("<I", len(head)) + head
    body += b"data" + struct.pack("<I", len(data)) + data
    return b"RIFF" + struct.pack("<I", len(body)) + body


@pytest.mark.parametrize("bits", [16, 24, 32])
def test_wav_of_counts(tmp_path, bits):
    """Whole numbers of 16 or 24 bits come in as counts, which `scale` makes a pressure; floating
    point numbers come in as they are. The file of 24 bits is written byte by byte here."""
    counts = np.round(ALL / COUNT).astype(np.int32)
    counts[2] //= 7  # within 16 bits

    def write(path):
        if bits == 16:
            wavfile.write(path, int(RATE), counts.T.astype(np.int16))
        elif bits == 32:
            wavfile.write(path, int(RATE), (counts.T * COUNT).astype(np.float32))
        else:
            packed = counts.T.astype("<i4").copy().view(np.uint8).reshape(-1, 4)[:, :3].tobytes()
            path.write_bytes(wav_bytes(packed, channels=4, bits=24))

    scale = 1.0 if bits == 32 else COUNT
    same(read(tmp_path, "r.wav", write, scale=scale, **NUMBERED), relative=1e-4)


@pytest.mark.parametrize(("valid_bits", "unused"), [(None, 1), (32, 1), (24, 256), (20, 4096)])
def test_the_header_of_a_wav_says_the_size_of_its_counts(tmp_path, valid_bits, unused):
    """Samples of 32 bits, all multiples of 256 and then not: the scale is that of the header's bits
    in both files, whatever the values of the samples."""
    path = tmp_path / "r.wav"
    for low_bits in (0, 1):
        samples = (256 * np.arange(-50, 50, dtype="<i4") + low_bits).reshape(50, 2)
        path.write_bytes(wav_bytes(samples.tobytes(), 2, 32, valid_bits))
        found = wav.read(path, Layout(("p1", "p2")))
        np.testing.assert_array_equal(found.pressure, samples.T / unused)


@pytest.mark.parametrize("mean", [0.0, 9.5e6])
def test_wav_of_counts_without_a_scale_is_told(tmp_path, mean):
    """Counts are no pascals. Those of an AC-coupled sensor could be: only the file's type tells."""
    counts = np.round((PRESSURE - 9.5e6 + mean) / (COUNT if mean else 10.0)).astype(np.int16)
    content = sheet()
    content["recordings"][0].update(file="r.wav")
    write_case(tmp_path, content, pressure=None)
    wavfile.write(tmp_path / "r.wav", int(RATE), counts.T)
    refused(tmp_path, "r.wav", "scale", "raw counts", "Pa a count")
    content["recordings"][0].update(scale=1 if mean == 0.0 else COUNT)
    write_case(tmp_path, content, pressure=None)
    assert not [w for w in load_case(tmp_path).warnings if "whole numbers" in w]


@pytest.mark.parametrize("binary", [0, 1])
def test_universal_file(tmp_path, binary):
    """Data sets 58 of functions of time, called by their identification; a spectrum among them is
    left."""

    def write(path):
        file = pyuff.UFF(str(path))
        rows = {"other": OTHERS[1], "outlet": PRESSURE[0], "pipe": PRESSURE[1]}
        for func_type, names in ((2, ["outlet"]), (1, list(rows))):
            for name in names:
                file.write_sets(
                    pyuff.prepare_58(
                        binary=binary,
                        id1=name,
                        func_type=func_type,
                        rsp_node=1,
                        rsp_dir=1,
                        ref_node=1,
                        ref_dir=1,
                        data=rows[name],
                        x=TIME,
                        ord_data_type=4,
                        abscissa_spacing=1,
                        abscissa_min=0.0,
                        abscissa_inc=1 / RATE,
                        orddenom_spec_data_type=0,
                    ),
                    "add",
                )

    same(read(tmp_path, "r.uff", write, channels={"p1": "outlet", "p2": 3}), relative=1e-6)


def test_parquet(tmp_path):
    """Columns as in CSV; a whole number with a decimal point is one."""
    import pandas as pd

    def write(path):
        table = {"t": TIME, "x": OTHERS[0], "in": PRESSURE[0], "out": PRESSURE[1]}
        pd.DataFrame(table).to_parquet(path)

    same(read(tmp_path, "r.parquet", write, time="t", channels={"p1": "in", "p2": 4.0}))


@pytest.mark.parametrize(
    ("name", "package"), [("r.parquet", "pyarrow"), ("r.uff", "pyuff"), ("r.unv", "pyuff")]
)
def test_a_library_that_is_not_installed_is_named(tmp_path, monkeypatch, name, package):
    """The package and the extra that has it, no traceback."""
    content = sheet()
    content["recordings"][0].update(file=name)
    write_case(tmp_path, content, pressure=None)
    (tmp_path / name).write_bytes(b"anything")
    for module in ("parquet", "uff58"):
        monkeypatch.delitem(sys.modules, f"rippletwin.case.readers.{module}", raising=False)
    monkeypatch.setitem(sys.modules, package, None)
    refused(tmp_path, name, "file", package, "rippletwin[readers]")


DUCT = MEASURED / "duct_six_microphones" / "empty.h5"


@pytest.mark.skipif(not DUCT.exists(), reason="no measurements beside the repository")
def test_the_measured_duct_is_read_by_rig_yaml_alone(tmp_path, monkeypatch):
    """Six microphones of the recorder's own file, unconverted: the file's own samples."""
    shutil.copy(ROOT / "resources" / "duct" / "rig.yaml", tmp_path)
    monkeypatch.setenv("RIPPLETWIN_DATA", str(DUCT.parent))
    (tmp_path / "empty.h5").symlink_to(DUCT)
    (recording,) = load_case(tmp_path).recordings
    with h5py.File(DUCT) as file:
        np.testing.assert_array_equal(recording.pressure, file["time_data"][:].T)
    assert recording.sampling_rate_hz == 51200
