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
    SENSORS,
    VISCOSITY,
    network,
    ripple,
    samples,
)
from rippletwin.line.frequency_domain.line_network import Insert
from rippletwin.line.time_domain.line_elements import (
    Branch,
    Element,
    End,
    Pipe,
    TimeDomainLine,
    capacitance,
)
from rippletwin.line.time_domain.method_of_characteristics import simulate, steps_a_period
from rippletwin.twin.effects.side_branch import branch_admittance
from summed_friction import summed_friction

OIL = {"density": DENSITY, "viscosity": VISCOSITY}
ORIFICE = End("orifice", 0.0, COEFFICIENT)
PERIOD = 1 / PUMPING_HZ
ORDERS = np.arange(1, 34)  # of the pumping frequency, below 5 kHz
SHORT = (Pipe(0.8, 0.02, 1020.0), Pipe(0.5037, 0.015, 1300.0))
RESISTANCE = 2 * MEAN_PRESSURE / MEAN_FLOW


def misfit(a, b):
    return np.linalg.norm(a - b) / np.linalg.norm(b)


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


def short_line(steps, friction="unsteady", pipes=SHORT, inserts=(), source=0.0):
    """A short two-pipe line on a resistance, both ways, with the same `inserts`."""
    orders = np.arange(1, 31)
    s = 2j * np.pi * PUMPING_HZ * orders
    positions = [0.1234, 0.9, sum(p.length for p in pipes)]
    net = network(s, pipes, friction, source_flow=ripple(orders, corner_hz=3000.0))
    net.load = ("impedance", 4e9 + 0 * s)
    net.inserts = [in_the_chain(insert, s, friction) for insert in inserts]
    net.source_admittance = source * s
    line = TimeDomainLine(
        pipes,
        samples(net.source_flow, orders, MEAN_FLOW, steps),
        PERIOD,
        End("resistance", MEAN_PRESSURE, 1 / 4e9),
        friction=friction,
        positions=positions,
        source=[capacitance(0.0, source)] if source else [],
        inserts=list(inserts),
        **OIL,
    )
    return simulate(line, periods=200, tolerance=1e-7).harmonics(orders), net, positions


def in_the_chain(insert, s, friction):
    """The same for the frequency domain."""
    if isinstance(insert, Branch):
        pipe, thicker = insert.pipe, insert.viscosity_ratio * VISCOSITY
        y = branch_admittance(
            s, pipe.length, pipe.diameter, pipe.wave_speed, DENSITY, thicker, friction
        )
        return Insert(insert.position, "shunt", y)
    return Insert(insert.position, insert.kind, insert.immittance(s))


def without_effect(net):
    return network(net.s, SHORT, source_flow=net.source_flow, load=net.load)


def test_peaks_converge_as_the_step_shrinks():
    """Against the frequency domain with the same ten weights the error falls as dt^2 to nothing."""
    errors = []
    for steps in (256, 512, 1024):
        moc, net, positions = short_line(steps)
        for k, pipe in enumerate(SHORT):
            rate = 4 * VISCOSITY / pipe.diameter**2
            inertance = DENSITY / (0.25 * np.pi * pipe.diameter**2)
            net.series[k] = inertance * rate * summed_friction(net.s / rate)
        errors.append(misfit(moc, net.pressure_at(positions)))
    assert errors[2] < 3e-4
    assert errors[0] / errors[1] > 3 and errors[1] / errors[2] > 3


def test_no_wave_speed_is_rounded_to_the_grid():
    """Lengths that are no whole number of steps: the error is that of the cubic, not of rounding.

    Rounding the two pipes to whole steps would move the ripple by percents.
    """
    moc, net, positions = short_line(1024, "none")
    assert misfit(moc, net.pressure_at(positions)) < 1e-4
    rounded = []
    for pipe in SHORT:
        cell = pipe.wave_speed * PERIOD / 1024
        length = round(pipe.length / cell) * cell
        rounded.append(Pipe(length, pipe.diameter, pipe.wave_speed))
    other = network(net.s, rounded, "none", source_flow=net.source_flow, load=net.load)
    assert misfit(other.pressure_at(positions), net.pressure_at(positions)) > 3e-3


VOLUME, LEAK, W = 2e-14, 5e-11, 2 * np.pi * 700.0
SPOOL = Element(1.3037, "shunt", (0.4 / 4e9 * W**2,), (1.0, 0.6 * W, W**2))
RESONATOR = Element(0.5, "series", (3e9 * W, 0.0), (1.0, 0.3 * W, W**2))
MASS = Element(1.0, "series", (3e5, 0.0))
STUB = Branch(0.8, Pipe(0.3, 0.008, 1250.0), 0.6)


@pytest.mark.parametrize(
    "inserts, source",
    [
        ([capacitance(0.5, VOLUME)], 0.0),
        ([capacitance(1.3037, VOLUME)], 0.0),
        ([Element(1.1, "shunt", (LEAK,))], 0.0),
        ([STUB], 0.0),
        ([], VOLUME),
        ([MASS], 0.0),
        ([RESONATOR], 0.0),
        ([SPOOL], 0.0),
        ([MASS, capacitance(1.0, VOLUME), RESONATOR, Element(0.5, "series", (1e9,))], VOLUME),
        ([STUB, MASS, capacitance(0.8, VOLUME), SPOOL], 0.0),
    ],
    ids=[
        "volume",
        "load volume",
        "leak",
        "side branch",
        "source volume",
        "inertance",
        "series resonator",
        "spool",
        "ladders",
        "branch in a ladder",
    ],
)
def test_elements_are_the_inserts_of_the_chain(inserts, source):
    """Elements in time are the same immittances in the frequency domain, in the same order."""
    moc, net, positions = short_line(1152, inserts=inserts, source=source)
    chain = net.pressure_at(positions)
    assert misfit(moc, chain) < 0.002
    assert misfit(without_effect(net).pressure_at(positions), chain) > 0.05  # it is no trifle


def test_pieces_too_short_for_cells_converge():
    """Six millimetres between elements, less than three cells, come to what the chain says as the
    step falls: a lumped piece is right to second order."""
    inserts = [capacitance(0.006, VOLUME), MASS, capacitance(1.011, VOLUME)]
    errors = []
    for steps in (1152, 4608):
        moc, net, positions = short_line(steps, inserts=inserts)
        errors.append(misfit(moc, net.pressure_at(positions)))
    assert errors[1] < 0.002
    assert errors[1] < errors[0] / 4


def test_order_within_a_ladder_matters():
    """A volume before and behind an inertance are two things, in both domains."""
    ahead, behind = [
        short_line(2304, inserts=pair)
        for pair in ([capacitance(1.0, VOLUME), MASS], [MASS, capacitance(1.0, VOLUME)])
    ]
    assert misfit(ahead[0], behind[0]) > 0.01
    for moc, net, positions in (ahead, behind):
        assert misfit(moc, net.pressure_at(positions)) < 0.002


def test_viscoelastic_wall_is_its_admittance():
    """Kelvin-Voigt walls in time are Y' (1 + sum kappa/(1 + s tau)) (independent verification)."""
    hose = (Pipe(0.8, 0.02, 1020.0, ((0.3, 2e-4), (0.1, 2e-3))), SHORT[1])
    moc, net, positions = short_line(768, pipes=hose)
    bare = short_line(1024)[1].pressure_at(positions)
    chain = net.pressure_at(positions)
    assert misfit(moc, chain) < 0.002
    assert misfit(bare, chain) > 0.05


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


def test_what_has_not_settled_says_so():
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
