"""Readings in the time domain where the line is too finely cut for cells of its own.

Independent truth: the same line in the frequency domain, which knows no cells.
"""

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
from rippletwin.harmonics import peak_amplitudes
from rippletwin.line.frequency_domain.line_network import Insert
from rippletwin.line.time_domain.line_elements import (
    Element,
    End,
    Pipe,
    TimeDomainLine,
    capacitance,
    inertance,
)
from rippletwin.line.time_domain.method_of_characteristics import simulate

STEPS = 2304  # a period of 6.7 ms: three cells are 9 mm of line
FIRST, LAST = Pipe(0.8, 0.0197, 1020.0), Pipe(0.5037, 0.0197, 1300.0)
BLOCK = Pipe(0.008, 0.008, 1300.0)  # of a sensor, with a narrow bore
LONG = FIRST, LAST
END = FIRST.length + LAST.length


def read_both(pipes, positions, inserts=(), passage=0.0):
    """Harmonics of pressure and of flow at the positions, (2, S, F), in time and in frequency."""
    orders = np.arange(1, 31)
    s = 2j * np.pi * PUMPING_HZ * orders
    net = network(s, pipes, "steady", source_flow=ripple(orders, corner_hz=3000.0))
    net.load, net.source_admittance = ("impedance", 4e9 + 0 * s), 2e-14 * s
    net.source_impedance = passage * s
    net.inserts = [Insert(i.position, i.kind, i.immittance(s)) for i in inserts]
    line = TimeDomainLine(
        pipes,
        samples(net.source_flow, orders, MEAN_FLOW, STEPS),
        1 / PUMPING_HZ,
        End("resistance", MEAN_PRESSURE, 1 / 4e9),
        DENSITY,
        VISCOSITY,
        "steady",
        positions=positions,
        source=[capacitance(0.0, 2e-14)],
        passage=[inertance(0.0, passage)] if passage else [],
        inserts=list(inserts),
    )
    moc = simulate(line, periods=200, tolerance=1e-7)
    return np.array([peak_amplitudes(x)[:, orders] for x in (moc.pressure, moc.flow)]), np.array(
        net.respond(positions)
    )


@pytest.mark.parametrize(
    "pipes, positions, inserts, passage",
    [
        ((FIRST, BLOCK, LAST), (0.8, 0.804, 0.808), (), 0.0),
        ((BLOCK, FIRST, LAST), (0.0, 0.004), (), 0.0),
        ((FIRST, LAST, BLOCK), (END + 0.004, END + 0.008), (), 0.0),
        (LONG, (0.0, 0.003, 0.006), (inertance(0.006, 3e5),), 0.0),
        (LONG, (END - 0.006, END - 0.003, END), (inertance(END - 0.006, 3e5),), 0.0),
        (LONG, (0.0,), (capacitance(0.006, 1e-13),), 0.0),
        (LONG, (0.0,), (inertance(0.0, 3e5), capacitance(0.0, 2e-14)), 0.0),
        (LONG, (0.0, 0.002), (capacitance(0.004, 1e-13),), 1e6),
        (LONG, (0.0, 1e-3), (), 3e5),
        (LONG, (END,), (inertance(END, 3e5), Element(END, "shunt", (1e-10,))), 0.0),
    ],
    ids=[
        "block",
        "block at the pump",
        "block at the load",
        "inertance near the pump",
        "inertance near the load",
        "volume near the pump",
        "elements at the pump",
        "passage and volume",
        "passage",
        "elements at the load",
    ],
)
def test_each_reading_is_taken_in_its_own_piece(pipes, positions, inserts, passage):
    """Pressure and flow of every place agree with the frequency domain to 0.3 %: in a piece too
    short for cells, on each side of an element beside it, and behind the pump's passage. Through
    another pipe or behind the element they would be 5 to 70 % off. Friction is steady, which is
    what a lumped piece has."""
    moc, chain = read_both(pipes, positions, inserts, passage)
    errors = [[misfit(a, b) for a, b in zip(*both)] for both in zip(moc, chain)]
    print(np.array(errors))
    assert np.max(errors) < 0.003
