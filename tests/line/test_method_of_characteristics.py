"""The method of characteristics against the frequency domain and against analytic transients."""

import numpy as np
import pytest

from harmonic_balance import balance_orifice
from paper_line import (
    COEFFICIENT,
    DENSITY,
    MEAN_FLOW,
    MEAN_PRESSURE,
    PIPES,
    PUMPING_HZ,
    VISCOSITY,
    misfit,
    network,
    ripple,
    samples,
)
from paper_rig import SENSORS
from rippletwin.line.time_domain.grid import Grid
from rippletwin.line.time_domain.line_elements import (
    End,
    Pipe,
    TimeDomainLine,
)
from rippletwin.line.time_domain.method_of_characteristics import simulate, steps_a_period
from rippletwin.line.time_domain.places import locate

OIL = {"density": DENSITY, "viscosity": VISCOSITY}
ORIFICE = End("orifice", 0.0, COEFFICIENT)
PERIOD = 1 / PUMPING_HZ
ORDERS = np.arange(1, 34)  # of the pumping frequency, below 5 kHz
RESISTANCE = 2 * MEAN_PRESSURE / MEAN_FLOW


def whole_pipes(steps, cells):
    """Pipes of whole cells at `steps` a pumping period: Courant number one, no remainder."""
    dt = PERIOD / steps
    return [Pipe(n * p.wave_speed * dt, p.diameter, p.wave_speed) for n, p in zip(cells, PIPES)]


@pytest.mark.parametrize("load", ["anechoic", "resistance"])
def test_lossless_is_the_frequency_domain(load):
    """Independent verification: without friction at Courant 1 both are exact, to 1e-12."""
    steps, orders = 256, np.arange(1, 100)
    pipes = whole_pipes(steps, (224, 45, 50))
    positions = [0.0, 64 * pipes[0].length / 224, pipes[0].length, sum(p.length for p in pipes)]
    s = 2j * np.pi * PUMPING_HZ * orders
    net = network(s, pipes, "none", source_flow=ripple(orders))
    net.load = ("anechoic", None) if load == "anechoic" else ("impedance", 6e9 + 0 * s)
    moc = simulate(
        TimeDomainLine(
            pipes,
            samples(net.source_flow, orders, MEAN_FLOW, steps),
            PERIOD,
            End(load, MEAN_PRESSURE, 1 / 6e9),
            friction="none",
            positions=positions,
            **OIL,
        ),
        periods=400,
        tolerance=1e-15,
    )
    p = net.pressure_at(positions)
    assert np.max(np.abs(moc.harmonics(orders) - p)) < 1e-12 * np.max(np.abs(p))
    assert np.max(moc.remainder) < 1e-9 or np.min(moc.remainder[moc.remainder > 1e-9]) > 1 - 1e-9


def test_joukowsky():
    """A flow step dq raises the pressure by rho a dq/A, and by twice that at a closed end."""
    pipe = Pipe(10.0, 0.02, 1000.0)
    rise = DENSITY * pipe.wave_speed / (np.pi * 1e-4) * 1e-5
    flow = np.where(np.arange(2000) < 1000, 1e-5, -1e-5)  # mean zero: steady start is rest
    positions = [0.0, 5.0, 10.0]
    moc = simulate(
        TimeDomainLine(
            [pipe], flow, 0.04, End("closed"), friction="none", positions=positions, **OIL
        ),
        periods=1,
    )
    t = np.arange(1, 2001) * 0.04 / 2000  # the state after each step
    arrival = np.array(positions) / pipe.wave_speed
    first, second = moc.pressure[0], moc.pressure[1]
    assert np.allclose(first[t < 0.0199], rise, rtol=1e-12)
    assert np.allclose(second[(t > arrival[1] + 1e-4) & (t < 0.0149)], rise, rtol=1e-12)
    assert np.all(second[t < arrival[1] - 1e-4] == 0)
    closed = moc.pressure[2, (t > arrival[2] + 1e-4) & (t < 0.0199)]
    assert np.allclose(closed, 2 * rise, rtol=1e-12)


@pytest.mark.parametrize("friction", ["steady", "unsteady"])
def test_a_period_may_have_an_odd_number_of_steps(friction):
    """What one period of an odd number of steps leaves behind is what the next begins with: two
    periods are the first and the second half of one period that is twice as long (the same steps
    in another order of calls)."""
    steps, positions = 601, [0.0, 3.3, 8.0]
    rng = np.random.default_rng(2)
    flow = MEAN_FLOW * (1 + 0.01 * rng.standard_normal(steps))

    def run(flow, period, periods):
        line = TimeDomainLine(
            PIPES, flow, period, ORIFICE, friction=friction, positions=positions, **OIL
        )
        grid = Grid(line)
        nodes = np.array([locate(grid, x).node for x in positions])
        return [grid.advance(nodes) for _ in range(periods)], grid

    (_, second), short = run(flow, PERIOD, 2)
    (whole,), long = run(np.tile(flow, 2), 2 * PERIOD, 1)
    for one, both in zip(second, whole):
        assert np.allclose(one, both[:, steps:], rtol=1e-12)
    for name in ("pressure", "flow", "forward", "backward"):
        assert np.allclose(getattr(short, name), getattr(long, name), rtol=1e-12)


def test_steady_flow_loses_hagen_poiseuille():
    """A steady flow through the whole line: 128 mu L q/(pi D^4) summed (analytic)."""
    flow = np.full(512, MEAN_FLOW)
    ends = [0.0, sum(p.length for p in PIPES)]
    moc = simulate(TimeDomainLine(PIPES, flow, PERIOD, ORIFICE, positions=ends, **OIL), periods=20)
    loss = sum(128 * DENSITY * VISCOSITY * p.length / (np.pi * p.diameter**4) for p in PIPES)
    drop = moc.pressure[0] - moc.pressure[1]
    assert np.allclose(drop, loss * MEAN_FLOW, rtol=1e-9)
    assert np.allclose(moc.pressure[1], MEAN_PRESSURE, rtol=1e-12)


def against_balance(friction, steps, orders=ORDERS, depth=0.05):
    """The paper's line, full-amplitude orifice, both ways: (S, F) of each."""
    s = 2j * np.pi * PUMPING_HZ * orders
    positions = [*SENSORS, sum(p.length for p in PIPES)]
    net = network(s, friction=friction, source_flow=ripple(orders, depth=depth))
    steps = steps_a_period(PIPES, PERIOD, steps)
    moc = simulate(
        TimeDomainLine(
            PIPES,
            samples(net.source_flow, orders, MEAN_FLOW, steps),
            PERIOD,
            ORIFICE,
            friction=friction,
            positions=positions,
            **OIL,
        ),
        periods=300,
        tolerance=3e-6,
    )
    assert moc.converged
    balance_orifice(net, mean_pressure=moc.pressure[-1].mean(), coefficient=COEFFICIENT)
    return moc.harmonics(orders), net.pressure_at(positions)


@pytest.mark.parametrize("friction", ["steady", "unsteady"])
def test_full_amplitude_orifice_is_the_harmonic_balance(friction):
    """Independent verification on the paper's rig: 0.5 % below 5 kHz, ripple 0.26 MPa rms."""
    moc, chain = against_balance(friction, 683)
    assert misfit(moc, chain) < 0.001
    assert np.max(np.linalg.norm(moc - chain, axis=0) / np.linalg.norm(chain, axis=0)) < 0.01


@pytest.mark.long
def test_every_harmonic_agrees_at_fine_steps():
    """At 205 kHz each single harmonic to 5 kHz agrees to 0.5 % over the three positions."""
    moc, chain = against_balance("unsteady", 1366)
    assert np.max(np.linalg.norm(moc - chain, axis=0) / np.linalg.norm(chain, axis=0)) < 0.005


def test_large_ripple_is_the_harmonic_balance():
    """A third of the mean pressure as ripple: the orifice bends hard, both bend alike."""
    moc, chain = against_balance("steady", 512, orders=np.arange(1, 11), depth=0.09)
    assert misfit(moc, chain) < 0.002


def test_energy_is_conserved_over_a_period():
    """Lossless line: the mean ripple power is the same at every place (conservation)."""
    pipes = whole_pipes(256, (100, 20, 30))
    orders = np.arange(1, 40)
    end = sum(p.length for p in pipes)
    moc = simulate(
        TimeDomainLine(
            pipes,
            samples(ripple(orders), orders, MEAN_FLOW, 256),
            PERIOD,
            ORIFICE,
            friction="none",
            positions=[0.0, pipes[0].length, end],
            **OIL,
        ),
        periods=3000,
        tolerance=1e-11,
    )
    power = np.mean(moc.pressure * moc.flow, axis=1)
    ripple_power = power - moc.pressure.mean(axis=1) * moc.flow.mean(axis=1)
    assert moc.converged
    assert np.allclose(moc.flow.mean(axis=1), MEAN_FLOW, rtol=1e-9)
    assert np.allclose(ripple_power, ripple_power[0], rtol=1e-6)


def test_unfinished_run_is_not_converged():
    """Stopped after two periods the run is not converged and names a place on the line."""
    flow = samples(ripple([1]), [1], MEAN_FLOW, 512)
    moc = simulate(
        TimeDomainLine(PIPES, flow, PERIOD, ORIFICE, positions=SENSORS, **OIL), periods=2
    )
    assert not moc.converged and moc.periods == 2 and moc.change > 1e-3
    assert 0 <= moc.worst_position <= sum(p.length for p in PIPES)


def test_wrong_use_is_refused():
    flow = np.full(64, MEAN_FLOW)
    with pytest.raises(ValueError, match="closed"):
        simulate(TimeDomainLine(PIPES, flow, PERIOD, End("closed"), **OIL))
    with pytest.raises(ValueError, match="shorter"):
        simulate(TimeDomainLine([Pipe(0.01, 0.02, 1000.0)], flow, PERIOD, ORIFICE, **OIL))
    with pytest.raises(ValueError, match="outside"):
        simulate(
            TimeDomainLine(PIPES, np.full(512, MEAN_FLOW), PERIOD, ORIFICE, positions=[9.0], **OIL)
        )
    with pytest.raises(ValueError, match="end"):
        simulate(TimeDomainLine(PIPES, np.full(512, MEAN_FLOW), PERIOD, End("valve"), **OIL))
