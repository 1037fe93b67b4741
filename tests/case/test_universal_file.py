"""Time steps of data sets 58: one for all sensors."""

import numpy as np
import pytest

from case_folders import RATE, refused, sheet, write_case
from good_recordings import PRESSURE
from rippletwin.case.load import load_case

pyuff = pytest.importorskip("pyuff")


def write(folder, steps):
    """A case whose two sensors have these time steps, s."""
    content = sheet()
    content["recordings"][0]["file"] = "r.uff"
    write_case(folder, content, None)
    for name, row, step in zip(("p1", "p2"), PRESSURE, steps, strict=True):
        data = {"binary": 1, "id1": name, "func_type": 1, "data": row, "ord_data_type": 4}
        data |= {"rsp_node": 1, "rsp_dir": 1, "ref_node": 1, "ref_dir": 1, "abscissa_spacing": 1}
        data |= {"x": step * np.arange(row.size), "abscissa_min": 0.0, "abscissa_inc": step}
        data |= {"orddenom_spec_data_type": 0}
        pyuff.UFF(str(folder / "r.uff")).write_sets(pyuff.prepare_58(**data), "add")


@pytest.mark.parametrize("steps", [(1.0, 1.0), (1.0, 1.0000005)])
def test_steps_that_differ_by_rounding_are_one(tmp_path, steps):
    write(tmp_path, [step / RATE for step in steps])
    assert load_case(tmp_path).recordings[0].sampling_rate_hz == pytest.approx(RATE, rel=1e-5)


@pytest.mark.parametrize(
    ("steps", "told"),
    [((1.0, 1.001), "time step differs between sensors"), ((0.0, 0.0), "0 s"), ((-1.0, -1.0), "s")],
)
def test_other_steps_are_refused(tmp_path, steps, told):
    write(tmp_path, [step / RATE for step in steps])
    refused(tmp_path, "r.uff", "abscissa_inc", told)
