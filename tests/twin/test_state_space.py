"""The line as a state space, against transfer matrices, circuit theory and characteristics."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import lsim

from leaking_pump import LOAD, SPEED, rig
from rippletwin.case.model import FlowRipple
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import find_effect
from rippletwin.twin.operating_point import OperatingCondition
from rippletwin.twin.propagation import propagate
from rippletwin.twin.state_space import line_response, twin_state_space
from rippletwin.twin.twin import Twin

HIGHEST_HZ, ORDERS = 2400.0, np.arange(1, 145)
SAMPLES = 2304  # a revolution


@pytest.fixture(scope="module")
def twin() -> Twin:
    """A line with friction that depends on the frequency, and a yielding wall."""
    wall = find_effect("viscoelastic_wall", None), Place("segment 1", 0)
    return Twin(rig(), friction="unsteady", effects=[wall])


@pytest.fixture(scope="module")
def ripple() -> FlowRipple:
    """A ripple of 1 % of the mean flow, so small that the orifice is linear, in the band alone."""
    random = np.random.default_rng(3)
    phase = random.uniform(0.0, 2.0 * np.pi, len(ORDERS))
    angle = np.arange(SAMPLES) * 360.0 / SAMPLES
    wave = np.cos(np.outer(np.deg2rad(angle), ORDERS) + phase) @ (1.0 / ORDERS)
    return FlowRipple(angle, 7e-4 * (1.0 + 0.01 * wave / np.std(wave)))


@pytest.fixture(scope="module")
def condition(ripple) -> OperatingCondition:
    return OperatingCondition.at_orders(ORDERS, SPEED / 60.0, LOAD, ripple)


@pytest.fixture(scope="module")
def space(twin, condition):
    return twin_state_space(twin, condition, SPEED / 60.0, HIGHEST_HZ)


def test_it_responds_as_the_transfer_matrices_do(twin, condition, space):
    """At shaft orders, which are not among the fitted frequencies, within the stated error."""
    found = space.at(2j * np.pi * condition.frequency_hz)
    expected = line_response(twin, condition, condition.frequency_hz)
    off = np.linalg.norm(found - expected, axis=1) / np.linalg.norm(expected, axis=1)
    assert np.all(space.error < 2e-3) and np.all(off < 2e-3)


def test_it_is_stable_and_passive(space):
    """All poles decay. The positive real lemma: of the Hamiltonian matrix of the first row no
    eigenvalue is imaginary, so that its real part is nowhere zero, and it is positive at one place.
    (Boyd, Balakrishnan & Kabamba 1989, Math. Control Signals Systems 2:207.)"""
    a, b, c, d = space.a, space.b, space.c[:1], space.d[:1]
    assert np.max(np.linalg.eigvals(a).real) < 0.0
    scale = np.max(np.abs(np.linalg.eigvals(a)))
    gain = np.max(np.abs(space.at(2j * np.pi * np.linspace(50.0, HIGHEST_HZ, 200))[0]))
    a, c, r = a / scale, c / scale / gain, 2.0 * d[0, 0] / gain
    left = a - b @ c / r
    hamiltonian = np.block([[left, -b @ b.T / r], [c.T @ c / r, -left.T]])
    values = np.linalg.eigvals(hamiltonian)
    assert r > 0.0 and np.min(np.abs(values.real)) > 1e-9


def test_it_simulates_what_characteristics_simulate(twin, ripple, condition, space):
    """One revolution of both sensors, periodic, by the matrix exponential, against the method of
    characteristics, which shares no code with it: 1.5 % of the ripple."""
    step = 60.0 / SPEED / SAMPLES
    time = np.arange(SAMPLES + 1) * step
    flow = np.append(ripple.flow, ripple.flow[0]) - ripple.flow.mean()
    system = space.a, space.b, space.c, space.d
    last = lsim(system, flow, time)[2][-1]
    start = np.linalg.solve(np.eye(len(space.a)) - expm(space.a * time[-1]), last)
    found = lsim(system, flow, time, X0=start)[1][:-1, 1:].T
    run = propagate(twin, ripple.flow, ripple.flow, SPEED / 60.0, LOAD)
    expected = run.pressure - run.pressure.mean(axis=1, keepdims=True)
    found -= found.mean(axis=1, keepdims=True)
    off = np.linalg.norm(found - expected, axis=1) / np.linalg.norm(expected, axis=1)
    assert np.all(off < 0.015), off
