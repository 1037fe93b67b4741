"""Time steps of data sets 58: one for all sensors."""

import pytest

from case_folders import RATE, refused, sheet, write_case
from good_recordings import write_universal
from rippletwin.case.load import load_case


def write(folder, steps):
    """A case whose two sensors have these time steps, in those of the sampling rate."""
    content = sheet()
    content["recordings"][0]["file"] = "r.uff"
    write_case(folder, content, None)
    write_universal(folder / "r.uff", [step / RATE for step in steps])


@pytest.mark.parametrize("steps", [(1.0, 1.0), (1.0, 1.0000005)])
def test_steps_that_differ_by_rounding_are_one(tmp_path, steps):
    write(tmp_path, steps)
    assert load_case(tmp_path).recordings[0].sampling_rate_hz == pytest.approx(RATE, rel=1e-5)


@pytest.mark.parametrize(
    ("steps", "told"),
    [((1.0, 1.001), "time step differs between sensors"), ((0.0, 0.0), "0 s"), ((-1.0, -1.0), "s")],
)
def test_other_steps_are_refused(tmp_path, steps, told):
    write(tmp_path, steps)
    refused(tmp_path, "r.uff", "abscissa_inc", told)
