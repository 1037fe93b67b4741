"""Elements, walls and pieces of any length in time, against the frequency domain."""

import numpy as np
import pytest

from paper_line import (
    DENSITY,
    MEAN_FLOW,
    MEAN_PRESSURE,
    PUMPING_HZ,
    VISCOSITY,
    misfit,
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
from rippletwin.line.time_domain.method_of_characteristics import simulate
from rippletwin.twin.effects.side_branch import branch_admittance
from summed_friction import summed_friction

OIL = {"density": DENSITY, "viscosity": VISCOSITY}
PERIOD = 1 / PUMPING_HZ
SHORT = (Pipe(0.8, 0.02, 1020.0), Pipe(0.5037, 0.015, 1300.0))


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


def test_a_branch_too_short_for_cells_is_its_admittance():
    """A dead end of 1 cm, less than two cells at 1152 steps, reads as the frequency domain says: it
    is a volume with the mass of a third of its oil. Its bore is wide, so that it matters."""
    stub = Branch(0.8, Pipe(0.01, 0.06, 1250.0), 0.6)
    moc, net, positions = short_line(1152, inserts=[stub])
    chain = net.pressure_at(positions)
    assert misfit(moc, chain) < 0.002
    assert misfit(without_effect(net).pressure_at(positions), chain) > 0.02


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
