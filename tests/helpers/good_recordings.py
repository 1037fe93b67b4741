"""A small good recording in every format of one file, for tests that damage it."""

from unittest import mock

import numpy as np
import pytest
import scipy.io

from case_folders import RATE, ripple, sheet, write_case, write_hdf5
from rippletwin.case.load import load_case
from rippletwin.case.rig_yaml import parse_sheet

PRESSURE = ripple(0.25)


def write_text(path):
    time = np.arange(PRESSURE.shape[1]) / RATE
    rows = np.column_stack([time, PRESSURE.T])
    np.savetxt(path, rows, "%.7g", ",", header="time_s,p1,p2", comments="")


def write_matlab(path):
    scipy.io.savemat(path, {"pressure": PRESSURE, "sampling_rate_hz": RATE})


def write_tdms(path):
    nptdms = pytest.importorskip("nptdms")
    channels = [
        nptdms.ChannelObject("g", name, row, {"wf_increment": 1 / RATE})
        for name, row in zip(("p1", "p2"), PRESSURE)
    ]
    with nptdms.TdmsWriter(path) as file:
        file.write_segment(channels)


def write_wav(path):
    scipy.io.wavfile.write(path, int(RATE), PRESSURE.T.astype(np.float32))


def write_parquet(path):
    pyarrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    columns = {"time_s": np.arange(PRESSURE.shape[1]) / RATE, "p1": PRESSURE[0], "p2": PRESSURE[1]}
    parquet.write_table(pyarrow.table(columns), path)


def write_universal(path, steps=(1 / RATE, 1 / RATE)):
    """Data sets 58 whose sensors have these time steps, s."""
    pyuff = pytest.importorskip("pyuff")
    for name, row, step in zip(("p1", "p2"), PRESSURE, steps):
        data = {"binary": 1, "id1": name, "func_type": 1, "data": row, "ord_data_type": 4}
        data |= {"rsp_node": 1, "rsp_dir": 1, "ref_node": 1, "ref_dir": 1, "abscissa_spacing": 1}
        data |= {"x": step * np.arange(row.size), "abscissa_min": 0.0, "abscissa_inc": step}
        data |= {"orddenom_spec_data_type": 0}
        pyuff.UFF(str(path)).write_sets(pyuff.prepare_58(**data), "add")


WRITE = {
    "r.h5": lambda path: write_hdf5(path, PRESSURE),
    "r.csv": write_text,
    "r.mat": write_matlab,
    "r.tdms": write_tdms,
    "r.wav": write_wav,
    "r.parquet": write_parquet,
    "r.uff": write_universal,
}


class Good:
    """A case with one good recording: its folder, the file, and the good bytes."""

    def __init__(self, folder, name, write):
        self.folder, self.path = folder, folder / name
        content = sheet()
        content["recordings"][0]["file"] = name
        write_case(folder, content, None)
        write(self.path)
        assert load_case(folder).recordings
        self.content = self.path.read_bytes() if self.path.is_file() else b""
        self._sheet = parse_sheet(folder / "rig.yaml")

    def load(self):
        """The case, as `load_case` reads it. The sheet stays as it is, and is parsed once: that
        takes longer than to read the recording."""
        with (
            mock.patch("rippletwin.case.load.parse_sheet", lambda path: self._sheet),
            mock.patch("rippletwin.case.load.find_sheet_faults", lambda path, sheet: ()),
        ):
            return load_case(self.folder)

    def __repr__(self):
        return self.path.name
