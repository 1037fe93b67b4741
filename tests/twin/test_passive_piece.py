"""A piece of another pipe is the two-port that cutting the line and joining it gives."""

import numpy as np
import pytest

from rippletwin.line.frequency_domain.line_network import FrequencyDomainLine, Insert
from rippletwin.line.frequency_domain.pipe_immittance import series_impedance, shunt_admittance
from rippletwin.twin.effects.base import LineState, Place
from rippletwin.twin.effects.library import EFFECTS
from two_domains import both, corrected, misfit

S = 2j * np.pi * np.linspace(50.0, 5000.0, 100)
LENGTHS, DIAMETERS, SPEEDS = (1.3, 0.9), (0.02, 0.016), (1020.0, 1200.0)  # m, m, m/s
DENSITY, VISCOSITY = 870.0, 3.2e-5
PIECE = EFFECTS["passive_piece"], Place("position")
HOSE = {
    "length": 0.3, "diameter_ratio": 1.2, "wave_speed_ratio": 0.5,
    "compliance_ratio": 0.1, "retardation_time": 2e-4, "conductance": 3e-11,
}  # fmt: skip
CHAMBER = HOSE | {"diameter_ratio": 2.0, "wave_speed_ratio": 1.0}


def line_of(lengths, diameters, speeds, creep=None) -> FrequencyDomainLine:
    """A line of pipes on a resistance, the one at index `creep` with the hose's creep."""
    fluid = {"density": DENSITY}
    series = [
        series_impedance(S, viscosity=VISCOSITY, diameter=d, friction="unsteady", **fluid)
        for d in diameters
    ]
    shunt = [
        shunt_admittance(S, wave_speed=a, diameter=d, **fluid) for a, d in zip(speeds, diameters)
    ]
    if creep is not None:
        shunt[creep] = shunt[creep] * (1.0 + 0.1 / (1.0 + 2e-4 * S))
    return FrequencyDomainLine(
        S, np.array(lengths), np.array(series), np.array(shunt),
        load=("impedance", 3e9 + 0.0 * S), sensor_positions=(0.2, 1.95),
    )  # fmt: skip


@pytest.mark.parametrize("values", [HOSE, CHAMBER], ids=["hose", "chamber"])
@pytest.mark.parametrize(
    "position, lengths, kinds",
    [
        (0.7, (0.55, 0.3, 0.45, 0.9), (0, None, 0, 1)),
        (1.25, (1.1, 0.3, 0.8), (0, None, 1)),  # over the joint of the segments
        (0.1, (0.3, 1.0, 0.9), (None, 0, 1)),  # pushed against the pump
    ],
)
def test_it_is_the_line_cut_and_joined(values, position, lengths, kinds):
    """Pressures at both sensors and the input impedance are those of the chain with a pipe of its
    own in place of the stretch and a leak at its middle, whose formulas the two-port does not
    use, to rounding. A sensor inside the piece is left out: the module states that limit."""
    piece = kinds.index(None)
    d = [values["diameter_ratio"] * DIAMETERS[0] if k is None else DIAMETERS[k] for k in kinds]
    a = [values["wave_speed_ratio"] * SPEEDS[0] if k is None else SPEEDS[k] for k in kinds]
    joined = line_of(lengths, d, a, creep=piece)
    middle = sum(lengths[:piece]) + 0.5 * lengths[piece]
    joined.inserts.append(Insert(middle, "shunt", values["conductance"] + 0.0 * S))
    changed = line_of(LENGTHS, DIAMETERS, SPEEDS)
    state = LineState(
        DENSITY, VISCOSITY, np.array(DIAMETERS), np.array(SPEEDS), np.array(LENGTHS),
        friction="unsteady",
    )  # fmt: skip
    PIECE[0].apply(changed, state, values | {"position": position}, PIECE[1])
    outside = slice(0, 2) if piece else slice(1, 2)
    here, there = joined.readings()[outside], changed.readings()[outside]
    assert there == pytest.approx(here, rel=1e-7, abs=1e-7 * np.max(np.abs(here)))
    assert changed.input_impedance() == pytest.approx(joined.input_impedance(), rel=1e-7)


@pytest.mark.parametrize("position", [0.4, 0.91, 0.77], ids=["inside", "joint", "short rest"])
def test_both_domains_have_the_same_piece(position):
    """The method of characteristics, with a pipe cut into the line, gives the ripple of the
    two-port to 0.5 %; the piece changes it a hundred times as much. The third position leaves a
    rest of the segment that is too short for cells."""
    twin, theta = corrected(PIECE), corrected(PIECE).theta.copy()
    length = 2 * (0.9 - position) - 0.005 if position == 0.77 else 0.15
    values = HOSE | {"position": position, "length": length}
    for name, value in values.items():
        k = twin.index[f"passive_piece@position.{name}"]
        theta[k] = twin.parameters[k].prior.coordinate(value)
    moc, chain = both(twin.with_(theta=theta))
    off = misfit(moc, chain)
    assert off < 5e-3
    assert misfit(both(corrected())[1], chain) > 100 * off


def test_it_is_told_in_words():
    """A hose and a chamber are told by what differs most from the line, with their numbers."""
    assert PIECE[0].describe(HOSE) == (
        "0.30 m of a softer pipe, with 1.20 times the diameter and 0.50 times the wave speed of "
        "the line"
    )
    chamber = {name: np.float64(value) for name, value in CHAMBER.items()}
    assert "wider pipe, with 2.00 times the diameter" in PIECE[0].describe(chamber)
