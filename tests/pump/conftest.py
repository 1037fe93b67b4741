"""The default pump, simulated once for all tests: into a constant pressure and into a pipe."""

import pytest

from default_pump import LOAD, OIL, PIPE, POSITIONS, SPEED
from rippletwin.pump.outlets import ConstantPressure, Pipe
from rippletwin.pump.simulation import simulate


@pytest.fixture(scope="package")
def constant():
    return simulate({}, OIL, SPEED, ConstantPressure(LOAD))


@pytest.fixture(scope="package")
def piped():
    return simulate({}, OIL, SPEED, Pipe(PIPE, POSITIONS, load_pressure=LOAD))
