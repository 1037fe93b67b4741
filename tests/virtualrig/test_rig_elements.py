"""Elements of the virtual rig's line on their own: velocity modes of a pipe, gas at a node."""

import numpy as np
import pytest
from scipy.special import ive

from virtualrig.network import Network, Node, Pipe, node_table
from virtualrig.node_elements import NODE_STATES, STORED, settle_node
from virtualrig.profile import velocity_modes


def test_velocity_modes_are_the_bessel_admittance_and_passive():
    """Ten lags have Zielke's friction to 0.2 % over the band in use and the exact steady
    resistance; all weights and rates are positive."""
    rates, weights = velocity_modes(10)
    s = 1j * np.geomspace(150, 1e5, 400)  # 16 Hz to 5 kHz in these pipes
    z = np.sqrt(s)
    exact_friction = s * ive(0, z) / ive(2, z) - s
    friction = 1 / (weights / (s[:, None] + rates)).sum(axis=1) - s
    assert np.abs(friction / exact_friction - 1).max() < 2e-3
    assert (weights > 0).all() and (rates > 0).all()
    assert 1 / (weights / rates).sum() == pytest.approx(8, rel=1e-10)


def test_gas_has_the_stiffness_of_its_absolute_pressure():
    """One time step of a node with gas alone, at a gauge pressure of 5 bar: a small flow raises the
    pressure as the polytropic law at 6 bar says, which the same law at 5 bar misses by a sixth."""
    gauge, volume, exponent, lead, flow = 5e5, 1e-6, 1.3, 1e5, 1e-9
    absolute = gauge + 1.01325e5
    network = Network(
        (Pipe(1.0, 0.02, 1000.0, 0, 1),),
        (Node(), Node(gas_volume=volume, gas_pressure=absolute, gas_exponent=exponent)),
        (), 870.0, 3.2e-5,
    )  # fmt: skip
    table = node_table(network)[1]
    history, state = np.zeros(NODE_STATES), np.zeros(NODE_STATES)
    history[STORED] = -lead * volume  # at rest: all steps before have the same gas volume
    pressure = settle_node(table, history, state, lead, flow, 0.0, gauge)
    assert pressure - gauge == pytest.approx(flow * exponent * absolute / (lead * volume), rel=1e-3)
