"""The frequency-domain chain against matrices, waves and conservation laws."""

import numpy as np
import pytest
from scipy.linalg import expm

from paper_line import DENSITY, PIPES, immittances, network
from paper_rig import SENSORS
from rippletwin.line.frequency_domain.line_network import FrequencyDomainLine, Insert

S = 2j * np.pi * np.array([3.0, 150.0, 1234.5, 4999.0])


def with_inserts(s):
    end = sum(p.length for p in PIPES)
    return [
        Insert(0.0, "series", 3e8 + 2e4 * s),
        Insert(2.0, "shunt", 1e-13 * s),
        Insert(2.0, "series", 1e5 * s),
        Insert(PIPES[0].length, "shunt", 2e-11 + 0 * s),
        Insert(end, "shunt", 3e-14 * s),
    ]


def exponential_chain(s):
    """The same line by matrix exponentials of its differential equations."""
    series, shunt = immittances(s)
    inserts, matrices = with_inserts(s), []
    for i in range(len(s)):
        pieces = [
            (0, 0.0, inserts[0]),
            (0, 2.0, inserts[1]),
            (0, 0.0, inserts[2]),
            (0, PIPES[0].length - 2.0, inserts[3]),
            (1, PIPES[1].length, None),
            (2, PIPES[2].length, inserts[4]),
        ]
        total = np.eye(2, dtype=complex)
        for k, length, insert in pieces:
            total = total @ expm(
                np.array([[0, series[k, i]], [shunt[k, i], 0]], dtype=complex) * length
            )
            if insert is not None:
                v = insert.immittance[i]
                element = [[1, v], [0, 1]] if insert.kind == "series" else [[1, 0], [v, 1]]
                total = total @ np.array(element)
        matrices.append(total)
    return np.array(matrices)


def test_transfer_matrix_is_the_exponential_of_the_equations():
    """Independent verification: d[p,q]/dx = -[[0,Z'],[Y',0]][p,q] integrated by expm."""
    t = network(S, inserts=with_inserts(S)).transfer()
    reference = exponential_chain(S)
    scale = np.abs(reference).max(axis=0)
    assert np.max(np.abs(t - reference) / scale) < 1e-9


def test_determinant_is_one():
    """Conservation: det T = 1 for every passive reciprocal chain, inserts and all."""
    net = network(S, inserts=with_inserts(S))
    assert np.allclose(np.linalg.det(net.transfer()), 1, rtol=1e-11, atol=0)
    assert np.allclose(np.linalg.det(net.transfer(1.0, 6.5)), 1, rtol=1e-11, atol=0)


def test_transfer_matrices_compose():
    """T(0, x) T(x, L) = T(0, L), also where x is at inserts and at a joint (consistency)."""
    net = network(S, inserts=with_inserts(S))
    parts = net.transfer(0, 2.0) @ net.transfer(2.0, PIPES[0].length)
    parts = parts @ net.transfer(PIPES[0].length)
    assert np.max(np.abs(parts / net.transfer() - 1)) < 1e-9


def test_reciprocity():
    """The pressure at one end for a flow at the other is the same both ways round (theorem)."""
    there = network(S, inserts=with_inserts(S))
    end = there.length
    back = network(
        S,
        PIPES[::-1],
        inserts=[Insert(end - x, kind, v) for x, kind, v in with_inserts(S)[::-1]],
    )
    # The pump's side of the insert at x = L is not the end itself: use the open-circuit pressure.
    forth = there.thevenin_at_load()[0]
    assert np.allclose(forth, back.thevenin_at_load()[0], rtol=1e-10, atol=0)


@pytest.mark.parametrize(
    "load", [("open", None), ("closed", None), ("anechoic", None), ("admittance", 4e-11 + 0 * S)]
)
def test_power_in_is_power_lost(load):
    """Conservation of energy: power at the pump = dissipation by Re Z' along the line + load."""
    net = network(S, load=load)
    p, q = net.pressure_at([0.0])[0], net.flow_at([0.0])[0]
    entering = 0.5 * (p * q.conj()).real
    leaving = 0.5 * (net.pressure_at([net.length])[0] * net.flow_at([net.length])[0].conj()).real
    nodes, weights = np.polynomial.legendre.leggauss(200)
    lost, start = 0.0, 0.0
    for k, length in enumerate(net.lengths):
        x = start + 0.5 * length * (nodes + 1)
        density = 0.5 * net.series[k].real * np.abs(net.flow_at(x)) ** 2
        lost = lost + 0.5 * length * weights @ density
        start += length
    assert np.allclose(entering, lost + leaving, rtol=1e-9, atol=0)


def test_pressures_follow_from_matrices():
    """Pressures and flows at sensors = T(x, L) on the load's state (parity of two routes)."""
    admittance = 4e-11 * (1 + 0.2j) + 0 * S
    source = 1e-5 * np.exp(1j * np.arange(len(S)))
    net = network(
        S,
        load=("admittance", admittance),
        source_flow=source,
        source_admittance=1e-13 * S,
        inserts=with_inserts(S),
        sensor_positions=(*SENSORS[::-1], 8.0),
        sensor_factor=np.array([[1.0], [1.02], [0.9]]),
    )
    entry = net.transfer() @ np.stack([np.ones_like(S), admittance], axis=1)[..., None]
    load = source / (entry[:, 1, 0] + 1e-13 * S * entry[:, 0, 0])
    for row, x, gain in zip(net.readings(), net.sensor_positions, (1.0, 1.02, 0.9)):
        state = net.transfer(x) @ np.stack([load, admittance * load], axis=1)[..., None]
        assert np.allclose(row, gain * state[:, 0, 0], rtol=1e-9, atol=0)
        assert np.allclose(net.flow_at([x])[0], state[:, 1, 0], rtol=1e-9, atol=0)
    z = net.pressure_at([0.0])[0] / net.flow_at([0.0])[0]
    assert np.allclose(net.input_impedance(), z, rtol=1e-12, atol=0)


def test_thevenin_predicts_any_load():
    """p = p_oc/(1 + Z Y) with one open circuit is what the line with each load says (theorem)."""
    net = network(S, inserts=with_inserts(S), source_admittance=2e-12 + 1e-14 * S)
    open_circuit, z = net.thevenin_at_load()
    a, b, c = net.load_relation()
    for y in (0.0, 4e-11, 1e-12 * S):
        # A sensor at x = L would be on the pump's side of the insert there.
        net.load = ("admittance", y + 0 * S)
        impedance = network(S, inserts=with_inserts(S), load=net.load).input_impedance()
        assert np.all(np.isfinite(impedance))
        p = open_circuit / (1 + z * y)
        assert np.allclose(a * p + b * y * p, c, rtol=1e-11, atol=0)
        entry = net.pressure_at([0.0])[0]
        whole = network(S, inserts=with_inserts(S)).transfer()
        assert np.allclose(entry, whole[:, 0, 0] * p + whole[:, 0, 1] * y * p, rtol=1e-9, atol=0)


def test_resonances_of_a_lossless_line():
    """A line closed at its end resonates at n a/2L, an open one at (2n-1) a/4L (analytic)."""
    pipe = PIPES[0]
    fundamental = pipe.wave_speed / (2 * pipe.length)
    n = np.arange(1, 20)
    s = 2j * np.pi * fundamental * np.concatenate([n, n - 0.5])
    zc = DENSITY * pipe.wave_speed / (0.25 * np.pi * pipe.diameter**2)
    closed = network(s, [pipe], friction="none", load=("closed", None)).input_impedance() / zc
    opened = network(s, [pipe], friction="none", load=("open", None)).input_impedance() / zc
    assert np.all(np.abs(closed[:19]) > 1e11) and np.all(np.abs(closed[19:]) < 1e-11)
    assert np.all(np.abs(opened[:19]) < 1e-11) and np.all(np.abs(opened[19:]) > 1e11)


def test_lossless_input_impedance_between_resonances():
    """Z = -j Zc cot(wL/a) closed and j Zc tan(wL/a) open (analytic)."""
    pipe = PIPES[0]
    zc = DENSITY * pipe.wave_speed / (0.25 * np.pi * pipe.diameter**2)
    angle = S.imag * pipe.length / pipe.wave_speed
    closed = network(S, [pipe], friction="none", load=("closed", None)).input_impedance()
    opened = network(S, [pipe], friction="none", load=("open", None)).input_impedance()
    assert np.allclose(closed, -1j * zc / np.tan(angle), rtol=1e-10, atol=0)
    assert np.allclose(opened, 1j * zc * np.tan(angle), rtol=1e-10, atol=0)


def test_strong_loss_does_not_overflow():
    """Where cosh(gamma l) overflows, p = Zc q exp(-gamma x) still holds (analytic, one wave)."""
    long = PIPES[0].__class__(2e5, PIPES[0].diameter, PIPES[0].wave_speed)
    net = network(S, [long], load=("closed", None))
    gamma, zc = np.sqrt(net.series[0] * net.shunt[0]), np.sqrt(net.series[0] / net.shunt[0])
    assert np.max((gamma * long.length).real) > 1e4
    x = np.array([0.0, 10.0, 300.0, 2e5])
    p = net.pressure_at(x)
    assert np.all(np.isfinite(p))
    strong = (gamma * long.length).real > 50
    expected = zc * np.exp(-x[:3, None] * gamma)
    assert np.allclose(p[:3, strong], expected[:, strong], rtol=1e-9, atol=0)
    assert np.all(np.isfinite(net.thevenin_at_load()))


def test_anechoic_load_reflects_nothing():
    """One segment ended by its own impedance has it as input impedance at every length."""
    net = network(S, PIPES[:1], load=("anechoic", None))
    assert np.allclose(net.input_impedance(), np.sqrt(net.series[0] / net.shunt[0]), rtol=1e-12)


def test_load_kinds_agree():
    """open, closed, impedance, admittance and state are one thing said in five ways (parity)."""
    z = 2e10 + 1e5 * S
    loads = [("impedance", z), ("admittance", 1 / z), ("state", (z, 1.0))]
    readings = [network(S, load=load, sensor_positions=SENSORS).readings() for load in loads]
    assert np.allclose(readings[0], readings[1], rtol=1e-11)
    assert np.allclose(readings[0], readings[2], rtol=1e-14)
    for kind, big in (("closed", 1e25), ("open", 1e-5)):
        limit = network(S, load=("impedance", big + 0 * S), sensor_positions=SENSORS).readings()
        given = network(S, load=(kind, None), sensor_positions=SENSORS).readings()
        assert np.allclose(given, limit, rtol=1e-9)


def test_wrong_use_is_refused():
    """Positions off the line and unknown names raise ValueError."""
    net = network(S)
    for x in (-0.1, net.length + 0.1):
        with pytest.raises(ValueError, match="outside"):
            net.pressure_at([x])
    with pytest.raises(ValueError, match="load"):
        network(S, load=("valve", None)).pressure_at([0.0])
    with pytest.raises(ValueError, match="shunt"):
        FrequencyDomainLine(
            S, net.lengths, net.series, net.shunt, inserts=[(1.0, "x", S)]
        ).pressure_at([0.0])


def test_the_line_begins_behind_the_pump_s_passage():
    """Of a lossless closed pipe, Zin = -j Zc cot(k l), the equations of the source give by hand
    Q = q(0) + Y p_pump and p_pump = p(0) + s I q(0): the sensor at 0 m reads p(0), and only the
    source's admittance sees p_pump."""
    impedance, admittance = 2e6 * S, 3e-10 + 1e-14 * S
    net = network(S, PIPES[:1], "none", source_admittance=admittance, source_flow=1e-5)
    net.source_impedance, net.sensor_positions = impedance, [0.0]
    gamma, zc = np.sqrt(net.series[0] * net.shunt[0]), np.sqrt(net.series[0] / net.shunt[0])
    zin = zc / np.tanh(gamma * net.length)
    flow = 1e-5 / (1.0 + admittance * (zin + impedance))
    assert np.allclose(net.readings()[0], zin * flow, rtol=1e-9)
    assert np.allclose(net.flow_at([0.0])[0], flow, rtol=1e-9)
    assert np.allclose(net.pump_pressure(), (zin + impedance) * flow, rtol=1e-9)


def test_flow_beyond_the_load_ratio_is_kirchhoffs():
    """At the load q = Y p + n with the flow n that was asked for, and the source's flow arrives:
    the state is that which `load_relation`, the line's own equation at the load, gives."""
    admittance, beyond = 1e-10 + 2e-15 * S, (3.0 - 2.0j) * 1e-6 * np.ones(len(S))
    line = network(S, inserts=with_inserts(S), load=("admittance", admittance))
    line.source_flow, line.load_outflow = 1e-5 * np.ones(len(S)), beyond
    line.inserts = line.inserts[:-1]  # the last stands at the load, behind the place of reading
    p, q = (x[0] for x in line.respond([line.length]))
    a, b, c = line.load_relation()
    assert np.allclose(q, admittance * p + beyond)
    assert np.allclose(a * p + b * q, c)


def test_some_frequencies_are_columns_of_all():
    """A line with everything in it, at two of its four frequencies."""
    line = network(S, inserts=with_inserts(S), load=("state", (1.0, 1e-10 + 2e-15 * S)))
    line.source_flow = 1e-5 * np.arange(1.0, 5.0)
    line.source_admittance, line.source_impedance = 1e-13 * S, 2e6 * S
    line.load_outflow = 1e-6 * np.arange(4.0)
    line.outflows = np.array([1.0, 4.0]), 1e-6 * np.ones((2, 4), complex)
    line.sensor_positions = SENSORS
    line.sensor_factor = np.tile(1.0 + 1e-5 * S, (len(SENSORS), 1))
    which = np.array([0, 3])
    assert np.allclose(line.at_frequencies(which).readings(), line.readings()[:, which], rtol=1e-12)


@pytest.mark.parametrize("leaks", [False, True])
def test_one_sweep_reads_what_the_load_makes(leaks):
    """The two solutions of the line, in the shares that a load asks for, are the readings of a
    sweep with that load: one that passes a flow beyond its linear part, and the linear part."""
    admittance, beyond = 1e-10 + 2e-15 * S, (3.0 - 2.0j) * 1e-6 * np.ones(len(S))
    line = network(S, inserts=with_inserts(S), load=("admittance", admittance))
    line.source_flow, line.source_admittance = 1e-5 * np.arange(1.0, 5.0), 1e-13 * S
    line.sensor_positions = SENSORS
    line.sensor_factor = np.tile(1.0 + 1e-5 * S, (len(SENSORS), 1))
    if leaks:
        line.outflows = np.array([1.0, 4.0]), 1e-6 * np.ones((2, 4), complex)

    def solve_load(a, b, c):
        p = (c - b * beyond) / (a + b * admittance)
        return p, admittance * p + beyond

    found = line.balance_load(solve_load)
    assert np.allclose(found.linear_readings, line.readings(), rtol=1e-10)
    line.load_outflow = beyond
    assert np.allclose(found.readings, line.readings(), rtol=1e-10)
    assert np.abs(found.readings / found.linear_readings - 1.0).max() > 0.01
