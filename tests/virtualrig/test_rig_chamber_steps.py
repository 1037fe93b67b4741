"""What a time step of the pump's chambers takes from tables and from the shape of its matrix."""

import numpy as np
import pytest

from virtualrig.elimination import eliminate, eliminate_arrow
from virtualrig.pump import Pump, chamber_kinematics, pump_tables
from virtualrig.stepper import tabulate_stations


def test_chambers_without_a_leak_between_them_are_solved_as_any_matrix_is():
    """The arrow's solution is that of the general elimination to the last bit, and solves it."""
    rng = np.random.default_rng(3)
    n = 6
    arrow = np.diag(rng.uniform(5.0, 9.0, n))
    arrow[-1, :-1], arrow[:-1, -1] = rng.uniform(-1, 1, (2, n - 1))
    arrow[-1, 2] = arrow[2, -1] = 0.0  # a closed port
    right = rng.standard_normal((n, 1))
    general, special = np.hstack([arrow, right]), np.hstack([arrow, right])
    eliminate(general)
    eliminate_arrow(special)
    assert np.array_equal(general[:, -1], special[:, -1])
    assert arrow @ special[:, -1] == pytest.approx(right[:, 0], rel=1e-12)


def test_tabulated_stations_are_those_of_the_crank_angle():
    """Row k - 1 is the pump's kinematics after k steps, with the ripple of the crank's speed."""
    chambers, ports = pump_tables(Pump(), 870.0)
    speed, dt, order, amplitude, shift = 100.0, 1e-4, 2.0, 0.01, 0.4
    ripple = np.array([[order, amplitude, shift]])
    table = tabulate_stations(chambers, ports, speed, ripple, 300, dt)
    single = np.zeros(table.shape[1:])
    for k in (1, 150, 300):
        turn = speed * k * dt
        angle = turn + amplitude / order * np.sin(order * turn + shift)
        rate = speed * (1 + amplitude * np.cos(order * turn + shift))
        chamber_kinematics(angle, rate, chambers, ports, single)
        assert table[k - 1] == pytest.approx(single, rel=1e-9, abs=1e-15)
    assert np.ptp(table[:, 0, 1]) > 0
