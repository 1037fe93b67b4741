"""Which mean and ripple can be pascals beside the load pressure: just inside and outside limits."""

from types import SimpleNamespace

import numpy as np
import pytest

from rippletwin.case.pressure_units import mean_warnings, unit_error

LOAD = 9e6  # Pa
PHASE = 2 * np.pi * np.arange(1000) / 1000


def problem_of(mean, ripple, load=LOAD, is_gas=False, row=None):
    """What is told of a sine of this mean and root mean square, Pa; None where nothing is."""
    row = mean + np.sqrt(2) * ripple * np.sin(PHASE) if row is None else row
    recording = SimpleNamespace(file="r.h5", load_pressure=load)
    rig = SimpleNamespace(fluid=SimpleNamespace(is_gas=is_gas))
    error = unit_error(recording, rig, "p1", row)
    return None if error is None else f"{error.problem}. {error.remedy}"


@pytest.mark.parametrize(
    ("mean", "ripple", "told"),
    [
        (27.9e6, 2e5, None),  # three times the load and 1 MPa
        (28.1e6, 2e5, "a mean of 2.81e+07 is implausible beside a load pressure of 9e+06 Pa"),
        (2.9e6, 1e5, None),  # a third of the load less 0.2 MPa
        (2.7e6, 1e5, "a mean of 2.7e+06 is implausible"),
        (2.7e6, 3e5, None),  # an AC-coupled sensor with an offset
        (0.0, 1e3, None),
        (0.0, 8e2, "a ripple of 800 rms is implausible beside 9e+06 Pa of load"),
        (8.9e3, 1e2, "a ripple of 100 rms is implausible"),
        (9.2e3, 1e2, "a mean of 9.2e+03 is implausible"),
        (0.0, 10.1e6, None),  # the load, 1 MPa of the line's resistance and an atmosphere
        (0.0, 10.2e6, "a ripple of 1.02e+07 rms is implausible beside 9e+06 Pa of load"),
        (0.0, 2e10, "Give pressure in Pa; or correct unit, scale or load_pressure"),
        (-1.2e5, 1e4, "below vacuum: the sign is inverted"),
        (-1.2e5, 1.3e4, None),
        (-1.0e5, 1e3, "a mean of 1e+05 is implausible"),
    ],
)
def test_limits_beside_the_load_pressure(mean, ripple, told):
    """Nothing is told inside a limit, and the number itself outside."""
    said = problem_of(mean, ripple)
    assert said is None if told is None else told in said


@pytest.mark.parametrize(
    ("ripple", "is_gas", "told"),
    [
        (11.0, False, False),
        (9.0, False, True),
        (1e-3, True, False),
        (0.9e8, False, False),
        (1.1e8, False, True),
        (1.1e8, True, True),
    ],
)
def test_limits_without_a_load_pressure(ripple, is_gas, told):
    """A ripple of a liquid's line below 10 Pa is none; a tube of gas may be that quiet. None has
    1000 bar: such a ripple is not said to look like bar."""
    said = problem_of(0.0, ripple, load=None, is_gas=is_gas)
    assert (said is not None) is told
    assert not told or ("looks like bar" in said) is (ripple < 10)


@pytest.mark.parametrize(
    ("unit", "pascals"), [("bar", 1e5), ("MPa", 1e6), ("kPa", 1e3), ("psi", 4.4482216 / 0.0254**2)]
)
def test_the_unit_is_told_from_the_mean(unit, pascals):
    """Within a factor of two of the load. A pound is 4.4482216 N, an inch 25.4 mm."""
    for factor, is_told in ((1.9, True), (0.55, True), (2.1, False), (0.45, False)):
        said = problem_of(factor * LOAD / pascals, 0.01 * LOAD / pascals)
        assert (f"looks like {unit}" in said) is is_told
    said = problem_of(LOAD / pascals, 0.01 * LOAD / pascals)
    assert float(said.partition("multiply by ")[2].partition(",")[0]) == pytest.approx(pascals)


@pytest.mark.parametrize(
    ("means", "is_told"),
    [
        ((9.1e6, 9.0e6), False),
        ((7.1e6, 9.0e6), False),  # one sensor with an offset
        ((7.1e6, 7.0e6), True),  # less than 0.8 of the load
        ((11.7e6, 11.9e6), False),  # 1.2 of the load and 1 MPa of the line's resistance
        ((11.9e6, 12.0e6), True),
        ((0.0, 0.1e6), False),  # AC-coupled
    ],
)
def test_a_load_pressure_that_all_sensors_contradict(means, is_told):
    """Two swapped entries of the data sheet: both sensors' means are another load's."""
    rows = np.array(means)[:, None] + 3e5 * np.sin(PHASE)
    recording = SimpleNamespace(label="a", load_pressure=LOAD, pressure=rows)
    rig = SimpleNamespace(sensors=[SimpleNamespace(name="p1"), SimpleNamespace(name="p2")])
    told = mean_warnings(recording, rig)
    assert bool(told) == is_told
    assert all("contradict load_pressure, 90 bar" in each for each in told)


def test_whole_numbers_of_a_converter_are_counts():
    """Up to 24 bits; a half is no count."""
    row = np.round(2000 + 500 * np.sin(PHASE))
    assert "raw counts: whole numbers only" in problem_of(0, 0, row=row)
    assert "counts" not in problem_of(0, 0, row=row + 0.5)
