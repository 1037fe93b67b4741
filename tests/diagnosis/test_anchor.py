"""The healthy recording that a diagnosis is anchored to."""

from itertools import permutations
from pathlib import Path

import numpy as np
import pytest

import leaking_pump
from rippletwin.case.model import Case, Recording
from rippletwin.diagnosis.anchor import correlate, distance, find_alignment, relative_misfit
from rippletwin.diagnosis.diagnose import find_anchors


def test_an_operating_point_set_twice_is_one():
    """Half a per cent of speed and one of pressure are no distance; more is the sum of both."""
    assert distance(1000.0, 1005.0, 9.5e6, 9.6e6) == 0.0
    assert distance(1000.0, 1200.0, 9.5e6, 9.5e6) == pytest.approx(np.log(1.2))
    assert distance(1000.0, 1200.0, 10e6, 5e6) == pytest.approx(np.log(1.2) + np.log(2.0))


def test_a_pressure_that_is_not_known_is_no_distance():
    """A load that states no pressure is told apart by its speed alone."""
    assert distance(1000.0, 1000.0, None, 5e6) == 0.0


def test_the_nearest_healthy_recording_is_the_anchor_in_any_order():
    """Of recordings of one operating point the least different is the anchor, then the others by
    how far they are and by label, however the sheet lists them."""

    def recording(label, speed_rpm, pressure=9.5e6, state="healthy"):
        return Recording(Path(f"{label}.h5"), "periodic", state, label, speed_rpm, pressure)

    unknown = recording("now", 1000.0, state="unknown")
    healthy = [
        recording("a", 1008.0),
        recording("d", 1001.0),
        recording("c", 1001.0),
        recording("b", 1000.5),
        recording("another point", 1200.0),
    ]
    for listed in permutations(healthy):
        case = Case(Path("case"), leaking_pump.rig(), (*listed, unknown))
        assert [r.label for r in find_anchors(case, unknown)] == ["b", "c", "d"]


@pytest.mark.parametrize("angle", [0.0, 0.31, 0.69])
def test_alignment_is_the_angle_by_which_a_spectrum_was_turned(angle):
    """Piston orders turned by an angle within a pitch: found to the step of the search."""
    rng = np.random.default_rng(0)
    orders = np.arange(9, 200, 9)
    here = rng.normal(size=(2, len(orders))) + 1j * rng.normal(size=(2, len(orders)))
    there = here * np.exp(1j * orders * angle)
    assert find_alignment(here, there, orders, 2 * np.pi / 9) == pytest.approx(angle, abs=1e-3)


def test_correlation_is_that_of_the_turned_spectrum():
    """At each angle the inner product as it is defined."""
    rng = np.random.default_rng(1)
    orders = np.arange(1, 40)
    here, there = rng.normal(size=(2, 2, 39)) + 1j * rng.normal(size=(2, 2, 39))
    found = correlate(here, there, orders, 1.0, 128)
    for k in (0, 17, 90):
        turned = here * np.exp(1j * orders * 2 * np.pi * k / 128)
        assert found[k] == pytest.approx(np.sum(np.conj(turned) * there).real)


def test_a_misfit_is_told_where_it_is():
    """A tenth is left of the ripple at low orders and half of it at high ones."""
    orders = np.arange(1, 181)
    readings = np.where(orders % 9 == 0, 1.0 + 1.0j, 0.0) * np.ones((2, 1))
    share = np.where(orders < 90, 0.1, 0.5)
    found = relative_misfit(share * readings, readings, orders, 9)
    np.testing.assert_allclose(found[(orders >= 9) & (orders < 60)], 0.1)
    np.testing.assert_allclose(found[orders < 9], 0.1 * orders[orders < 9] / 9)
    np.testing.assert_allclose(found[orders > 120], 0.5)
    assert np.all(np.diff(found) >= 0.0)
