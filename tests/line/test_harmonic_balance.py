"""Harmonic balance of the orifice; test_method_of_characteristics.py compares it in time."""

import numpy as np
import pytest

from harmonic_balance import balance, balance_orifice
from paper_line import COEFFICIENT, MEAN_FLOW, MEAN_PRESSURE, PIPES, PUMPING_HZ, network, ripple
from paper_rig import SENSORS
from rippletwin.line.time_domain.method_of_characteristics import Pipe

ORDERS = np.arange(1, 35)
S = 2j * np.pi * PUMPING_HZ * ORDERS


def driven(depth=0.05, s=S, orders=ORDERS, **options):
    return network(s, sensor_positions=SENSORS, source_flow=ripple(orders, depth=depth), **options)


@pytest.mark.parametrize("depth", [0.01, 0.4, 0.8])
def test_orifice_straight_at_the_source(depth):
    """With no line to speak of p = (q/K)^2: q0 + A cos gives 2 q0 A/K^2 and A^2/2K^2 (analytic)."""
    orders = np.arange(1, 9)
    s = 2j * np.pi * 1e-3 * orders
    flow = np.zeros(8, complex)
    flow[0] = amplitude = depth * MEAN_FLOW
    net = network(s, [Pipe(1e-6, 0.02, 1000.0)], "none", source_flow=flow)
    mean = (MEAN_FLOW**2 + amplitude**2 / 2) / COEFFICIENT**2
    result = balance_orifice(net, mean_pressure=mean, coefficient=COEFFICIENT)
    expected = np.zeros(8)
    expected[0] = 2 * MEAN_FLOW * amplitude / COEFFICIENT**2
    expected[1] = amplitude**2 / (2 * COEFFICIENT**2)
    assert result.converged
    assert np.max(np.abs(result.pressure - expected)) < 1e-6 * expected[0]
    assert result.mean_flow == pytest.approx(MEAN_FLOW, rel=1e-6)
    assert np.max(np.abs(result.flow - flow)) < 1e-6 * amplitude


@pytest.mark.parametrize("depth", [0.01, 0.08, 0.15])
def test_both_laws_hold_at_the_load(depth):
    """The converged state satisfies line and orifice, checked on a grid ten times finer."""
    net = driven(depth)
    relation = net.load_relation()
    result = balance_orifice(net, mean_pressure=MEAN_PRESSURE, mean_flow=MEAN_FLOW)
    assert result.converged
    a, b, c = relation
    assert np.max(np.abs(a * result.pressure + b * result.flow - c)) < 1e-8 * np.max(np.abs(c))
    t = np.arange(4096) / 4096
    wave = np.real(np.exp(2j * np.pi * np.outer(t, ORDERS)) @ result.pressure)
    flow = result.coefficient * np.sqrt(MEAN_PRESSURE + wave)
    assert flow.mean() == pytest.approx(MEAN_FLOW, rel=1e-7)
    harmonics = 2 * np.fft.rfft(flow)[ORDERS] / len(t)
    assert np.max(np.abs(harmonics - result.flow)) < 1e-5 * np.max(np.abs(result.flow))
    assert np.allclose(net.pressure_at([net.length])[0], result.pressure, rtol=1e-9)


def test_small_ripple_meets_the_linearised_orifice():
    """As the ripple vanishes the load is dq/dp = q0/2p0, and the error falls with the ripple."""
    errors = []
    for depth in (1e-3, 1e-4):
        net = driven(depth)
        balance_orifice(net, mean_pressure=MEAN_PRESSURE, mean_flow=MEAN_FLOW)
        linear = driven(depth, load=("admittance", MEAN_FLOW / (2 * MEAN_PRESSURE) + 0 * S))
        difference = net.readings() - linear.readings()
        errors.append(np.linalg.norm(difference) / np.linalg.norm(linear.readings()))
    assert errors[1] < 1e-4
    assert errors[0] / errors[1] == pytest.approx(10, rel=0.1)


def test_shaft_orders_contain_the_piston_orders():
    """Solved at all 1 ... 306 shaft orders, a nine-piston ripple is the piston-order solution."""
    few = driven(0.05)
    balance_orifice(few, mean_pressure=MEAN_PRESSURE, mean_flow=MEAN_FLOW)
    s = 2j * np.pi * PUMPING_HZ / 9 * np.arange(1, 307)
    flow = np.zeros(306, complex)
    flow[8::9] = few.source_flow
    many = network(s, sensor_positions=SENSORS, source_flow=flow)
    result = balance_orifice(many, mean_pressure=MEAN_PRESSURE, mean_flow=MEAN_FLOW)
    size = np.linalg.norm(few.readings())
    assert np.linalg.norm(many.readings()[:, 8::9] - few.readings()) < 1e-7 * size
    others = np.delete(result.pressure, np.s_[8::9])
    assert np.max(np.abs(others)) < 1e-8 * np.max(np.abs(result.pressure))


def test_missing_orders_carry_no_pressure():
    """Given orders 9, 18, ... of the shaft, the solution is that of 1, 2, ... of the pistons."""
    one, nine = driven(0.05), driven(0.05)
    first = balance_orifice(one, mean_pressure=MEAN_PRESSURE, mean_flow=MEAN_FLOW)
    second = balance_orifice(
        nine, mean_pressure=MEAN_PRESSURE, mean_flow=MEAN_FLOW, orders=9 * ORDERS
    )
    assert np.allclose(first.pressure, second.pressure, rtol=1e-6)


def test_few_passes_are_close():
    """The cheap variant: each pass takes at least a factor ten off the error at pump ripple."""
    exact = driven()
    balance_orifice(exact, mean_pressure=MEAN_PRESSURE, mean_flow=MEAN_FLOW)
    errors = []
    for passes in (0, 1, 2):
        net = driven()
        balance_orifice(net, mean_pressure=MEAN_PRESSURE, mean_flow=MEAN_FLOW, passes=passes)
        difference = net.readings() - exact.readings()
        errors.append(np.linalg.norm(difference) / np.linalg.norm(exact.readings()))
    assert errors[1] < 0.1 * errors[0] and errors[2] < 0.1 * errors[1]
    assert errors[2] < 1e-5


def test_any_law_can_be_the_load():
    """A linear law handed in as a function is the admittance load of the chain (parity)."""
    by_law, by_admittance = driven(), driven(load=("admittance", 4e-11 + 0 * S))
    result = balance(by_law, lambda wave: (4e-11 * wave, np.full_like(wave, 4e-11)))
    assert result.converged and result.passes == 1
    assert np.allclose(by_law.readings(), by_admittance.readings(), rtol=1e-11)


def test_resonance_of_a_lossless_line_is_no_singularity():
    """At a closed-end resonance the open-circuit pressure is infinite, the solution is not."""
    pipe = PIPES[0]
    s = 2j * np.pi * pipe.wave_speed / (2 * pipe.length) * np.arange(1, 9)
    net = network(s, [pipe], "none", source_flow=ripple(np.arange(1, 9)))
    result = balance_orifice(net, mean_pressure=MEAN_PRESSURE, coefficient=COEFFICIENT)
    assert result.converged
    # Half-wave line: what the pump gives, the orifice takes.
    assert np.allclose(np.abs(result.flow), np.abs(net.source_flow), rtol=1e-9)


def test_wrong_use_is_refused():
    with pytest.raises(ValueError, match="either"):
        balance_orifice(driven(), mean_pressure=1e7)
    with pytest.raises(ValueError, match="above"):
        balance_orifice(driven(), mean_pressure=1e5, mean_flow=1e-3, back_pressure=2e5)
    with pytest.raises(ValueError, match="ratio"):
        balance_orifice(driven(), mean_pressure=1e7, mean_flow=1e-3, orders=ORDERS + 1)
