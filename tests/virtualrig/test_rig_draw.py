"""Drawing of concealed cases: what is drawn, and from which random numbers."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from virtualrig.conceal import compared
from virtualrig.draw import MIX, UNCERTAINTY, draw, generator, kinds
from virtualrig.draw_effects import Bare, load_dynamics
from virtualrig.pump import Pump
from virtualrig.rig import build


@pytest.mark.parametrize("count", [60, 400])
def test_mix_is_the_stated_one(count):
    """Counts of each kind are the stated shares of the number of cases, exactly where they can."""
    counts = Counter(kind for kind, _ in kinds(count, "a", 1))
    assert counts == {kind: round(share * count) for kind, share in MIX.items()}


def test_cases_follow_from_commit_and_number_and_from_nothing_else():
    """The same twice; another commit or number gives other cases and another order."""
    first, again = draw(60, "a", 1, 5), draw(60, "a", 1, 5)
    assert first.sheet == again.sheet and first.truth == again.truth
    assert draw(60, "b", 1, 5).sheet != first.sheet != draw(60, "a", 2, 5).sheet
    assert kinds(60, "a", 1) != kinds(60, "b", 1)
    streams = [generator("a", 1, "case", k).uniform() for k in range(50)]
    assert len(set(streams)) == 50


@pytest.fixture(scope="module")
def drawn():
    return [draw(60, "a", 1, k) for k in range(60)]


def test_drawn_rigs_are_what_is_promised(drawn):
    """Two to four segments, two or three sensors, one to three points, noise of 0.5 to 4 kPa, and
    every rig can be built."""
    assert {len(d.sheet["line"]["segments"]) for d in drawn} == {2, 3, 4}
    assert {len(d.sheet["sensors"]) for d in drawn} == {2, 3}
    assert {len(d.points) for d in drawn} == {1, 2, 3}
    assert all(500 <= d.seal["noise"] <= 4000 for d in drawn)
    for d in drawn:
        rig = build(d.sheet, d.seal)
        assert len(rig.sensing) == len(d.sheet["sensors"])


def test_nominal_values_are_off_by_their_stated_uncertainty(drawn):
    """Over all cases wave speeds deviate by one standard deviation, in `off` cases by two to
    three."""
    pulls = {True: [], False: []}
    for d in drawn:
        pairs = zip(d.sheet["line"]["segments"], d.seal["line"]["segments"], strict=True)
        for sheet, true in pairs:
            pull = np.log(true["wave_speed"] / sheet["wave_speed"]) / UNCERTAINTY["wave_speed"]
            pulls[d.truth["kind"] == "off"].append(pull)
    assert np.std(pulls[False]) == pytest.approx(0.95, abs=0.2)
    assert (np.abs(pulls[True]) >= 2).all() and (np.abs(pulls[True]) <= 3).all()


def test_drawn_valves_feed_the_line_at_no_frequency():
    """The real part of flow over pressure is positive at all frequencies, by evaluation, also of
    the strongest; an active valve may chatter instead of settling into a ripple."""
    ratio = np.linspace(0.01, 10.0, 5000)  # of the valve's own frequency
    for k in range(300):
        valve = load_dynamics(Bare(np.random.default_rng(k), [], 2, 870.0, 1.5e9, 1e-3, 1e7), 1.0)
        gain, damping = valve.arguments["gain"], valve.arguments["damping"]
        assert np.min((0.5 + gain / (1 - ratio**2 + 2j * damping * ratio)).real) > 0.0


def test_flow_ripple_is_wrong_by_what_was_drawn():
    """The true pump's ripple, by this test's own spectrum and search for the angle, differs from
    the nominal one by the stated 1 to 4 %."""
    from virtualrig.source import constant_pressure_flow

    d = draw(60, "a", 1, 3)
    point, density = d.points[0], d.sheet["fluid"]["density"]
    pump = Pump(**d.sheet["pump"])
    true = pump.changed(d.seal["pump"]["relative"], d.seal["pump"]["timing_deg"])
    flows = [
        constant_pressure_flow(p, density, point.speed_rpm, point.load_pressure)
        for p in (true, pump)
    ]
    top = int(4000 / (point.speed_rpm / 60))
    order = np.arange(pump.pistons, top + 1, pump.pistons)
    a, b = (np.fft.fft(flow)[order] for flow in flows)
    angles = np.radians(np.linspace(-2, 2, 4001))
    misfits = [np.linalg.norm(a - b * np.exp(-1j * order * x)) for x in angles]
    assert 0.01 <= d.truth["source_error"] <= 0.04
    assert min(misfits) / np.linalg.norm(b) == pytest.approx(d.truth["source_error"], rel=0.1)


@pytest.mark.long
def test_floor_is_what_the_wrong_pump_leaves(drawn):
    """A true pump that is the sheet's leaves nothing, exactly; the one drawn leaves an error of the
    size of its flow's, which a line's resonances turn into a few times more or less."""
    d = next(d for d in drawn if d.truth["kind"] == "none" and len(d.points) == 1)
    right = replace(d, seal=d.seal | {"pump": {}})
    exact = compared(right)
    assert exact == {"change": 0.0, "floor": 0.0}
    wrong = compared(d)
    assert d.truth["source_error"] / 5 < wrong["floor"] < 5 * d.truth["source_error"]
