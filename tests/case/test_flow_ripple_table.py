"""Which angles of a flow ripple are one revolution."""

import numpy as np
import pytest

from rippletwin.case.tables import read_flow_ripple
from rippletwin.errors import InputError


def read(folder, angle):
    """The ripple of these angles, degrees; its flow (m3/s) grows with the row."""
    flow = 5e-4 + 1e-7 * np.arange(len(angle)) ** 2
    table = np.column_stack([angle, flow])
    path = folder / "q.csv"
    np.savetxt(path, table, "%.9g", ",", header="angle_deg,flow_m3_s", comments="")
    return read_flow_ripple(path), flow


@pytest.mark.parametrize(
    "angle",
    [
        np.arange(0.0, 360.0, 10.0),
        np.arange(5.0, 365.0, 10.0),  # from any angle on
        np.arange(0.0, 331.0, 10.0),  # three steps to the end
        np.linspace(0.0, 350.0, 32),
    ],
)
def test_one_revolution_is_read_whole(tmp_path, angle):
    found, flow = read(tmp_path, angle)
    np.testing.assert_allclose(found.angle_deg, angle, rtol=1e-8)
    np.testing.assert_allclose(found.flow, flow, rtol=1e-8)


def test_an_end_that_repeats_the_beginning_is_left_out(tmp_path):
    """0 and 360 degrees are one angle: the last row goes, and no other."""
    angle = np.linspace(0.0, 360.0, 37)
    found, flow = read(tmp_path, angle)
    np.testing.assert_allclose(found.angle_deg, angle[:-1])
    np.testing.assert_allclose(found.flow, flow[:-1], rtol=1e-8)


@pytest.mark.parametrize(
    "angle",
    [
        np.arange(0.0, 361.0, 10.0)[:31],  # too few
        np.linspace(0.0, 350.0, 31),
        np.append(np.arange(0.0, 360.0, 10.0), 360.1),  # more than one revolution
        np.arange(0.0, 321.0, 10.0),  # four steps are missing
    ],
)
def test_other_angles_are_refused(tmp_path, angle):
    with pytest.raises(InputError, match="not one revolution"):
        read(tmp_path, angle)
