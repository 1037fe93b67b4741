"""Which angles of a flow ripple are one revolution, and what its mean is."""

import numpy as np
import pytest

from rippletwin.case.tables import read_flow_ripple
from rippletwin.errors import InputError

EVEN = np.arange(0.0, 360.0, 2.0)
OPENINGS = np.add.outer(40.0 * np.arange(9), np.arange(0.0, 5.0, 0.02)).ravel()
REFINED = np.unique(np.round([*EVEN, *OPENINGS], 6))
"""Steps of 0.02 degrees about nine port openings, of 2 degrees elsewhere."""


def read(folder, angle, flow=None):
    """The ripple of these angles, degrees; its flow (m3/s) grows with the row unless given."""
    flow = 5e-4 + 1e-7 * np.arange(len(angle)) ** 2 if flow is None else flow
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
        REFINED,
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


@pytest.mark.parametrize("holes", [1, 3])
def test_a_hole_is_no_step(tmp_path, holes):
    """Rows are missing inside the revolution: three quarters of a piston's period, that the spline
    would make up. The refined table above has steps that differ by more, and is read."""
    angle = EVEN
    for k in range(holes):
        angle = angle[(angle <= 50.0 + 100 * k) | (angle >= 80.0 + 100 * k)]
    with pytest.raises(InputError, match=r"from 50 to 80 \(row 27\) among steps of 2 deg"):
        read(tmp_path, angle)


def test_the_mean_is_that_of_the_revolution(tmp_path):
    """Independent truth: 5e-4 m3/s is the mean of 5e-4 - 4e-3 cos. Most rows are where the flow is
    negative: their own mean is below zero, for which the ripple would be refused."""
    angle = np.unique([*EVEN, *np.arange(0.0, 60.0, 0.1)])
    flow = 5e-4 - 4e-3 * np.cos(np.radians(angle))
    found, _ = read(tmp_path, angle, flow)
    assert np.mean(flow) < -1e-3
    assert found.mean == pytest.approx(5e-4, rel=1e-4)
