"""Randomised training signals against a leaking pump coupled to its pipe step by step in time."""

from dataclasses import replace

import numpy as np
import pytest

import leaking_pump
from rippletwin.diagnosis import randomised_signals
from rippletwin.diagnosis.anchor import find_alignment
from rippletwin.diagnosis.pump_flow import NUMBERS
from rippletwin.diagnosis.randomised_signals import SignalSource, severity_bins
from rippletwin.harmonics import one_period, peak_amplitudes
from rippletwin.pump.faults import Cylinder, Slipper
from rippletwin.twin.twin import Twin

SAMPLES, AREA, PITCH = 1024, 4e-7, 2 * np.pi / leaking_pump.PISTONS
RANGES = {"S": [1e-7, 2e-6], "C": [1e-7, 2e-6]}


def recorded(fault=None, turn=0.3):
    """One noise-free mean revolution (S, M) of the true pump."""
    observation = leaking_pump.record("a", fault, turn)
    return one_period(observation.values, SAMPLES, observation.orders)


def source(twin=None, covariance=None, healthy=None):
    healthy = (recorded() if healthy is None else healthy)[None] + np.zeros((2, 1, 1))
    twin = twin or Twin(leaking_pump.rig())
    return SignalSource(twin, covariance, healthy, leaking_pump.SPEED / 60, leaking_pump.LOAD)


@pytest.fixture(scope="module")
def nominal():
    return source()


@pytest.fixture
def certain(nominal, monkeypatch):
    """The source with nothing left to chance but the piston."""
    monkeypatch.setattr(randomised_signals, "TURN_SD", 0.0)
    monkeypatch.setattr(randomised_signals, "SOURCE_DRIFT", 0.0)
    monkeypatch.setattr(nominal, "misfit", 0.0)
    monkeypatch.setattr(nominal, "_draw_drift", lambda lost, rng: np.zeros(3))
    monkeypatch.setattr(nominal, "_uneven", 0.0 * nominal._uneven)
    return nominal


def distance_at_best_angle(signal, truth):
    """Relative distance of two revolutions (S, M), the shaft angle being free."""
    orders = np.arange(1, 181)
    one, other = peak_amplitudes(signal)[:, orders], peak_amplitudes(truth)[:, orders]
    turn = np.exp(1j * orders * find_alignment(one, other, orders, 2 * np.pi))
    return np.linalg.norm(one * turn - other) / np.linalg.norm(other)


def test_an_anchored_healthy_signal_without_errors_is_the_recording(certain):
    """What the twin gets wrong about the healthy pump is not paid for again."""
    drawn = certain.draw({}, ("H",), 2, np.random.default_rng(0), anchored=True)
    np.testing.assert_allclose(drawn.pressure[0, 0], recorded(), atol=60)  # orders beyond 180 none


@pytest.mark.parametrize(("name", "fault"), [("S", Slipper(AREA, 3)), ("C1", Cylinder(AREA, 3))])
def test_a_signal_of_a_known_leak_is_what_the_pump_in_time_makes(certain, name, fault):
    """Anchored, one of the nine pistons agrees within 6 % of the ripple, and the healthy ripple is
    several times further off; by the twin alone no better than the twin's misfit allows."""
    bins = {name: (AREA, AREA * (1 + 1e-9))}
    truth, rng = recorded(fault), np.random.default_rng(0)
    best = {}
    for anchored in (True, False):
        drawn = certain.draw(bins, (name,), 40, rng, anchored).pressure[0]
        best[anchored] = min(distance_at_best_angle(signal, truth) for signal in drawn)
    assert best[True] < 0.06 and best[True] < best[False]
    assert distance_at_best_angle(recorded(), truth) > 4 * best[True]


def test_leak_areas_are_log_uniform_in_their_bins(nominal):
    """Each class has its range, and the mean logarithm is the middle's within four deviations."""
    bins = severity_bins(RANGES, 3.5e-7)
    drawn = nominal.draw(bins, ("H", "S", "C1", "C2"), 300, np.random.default_rng(1))
    assert (drawn.leak_area[0] == 0).all()
    for areas, name in zip(drawn.leak_area[1:], ("S", "C1", "C2")):
        low, high = np.log(bins[name])
        assert low <= np.log(areas).min() and np.log(areas).max() <= high
        middle = (np.log(areas).mean() - (low + high) / 2) / (high - low)
        assert abs(middle) < 4 / np.sqrt(12 * len(areas))
    assert bins["C1"][1] == bins["C2"][0] == 3.5e-7


def test_flow_is_the_pumps_and_needs_no_line(certain):
    """Against the simulated pump: the healthy source flow repeats with each piston, and a leak
    takes away what its area says: twice the area, about twice the missing ripple at the shaft."""
    drawn = certain.draw({}, ("H",), 1, np.random.default_rng(0))
    spectrum = abs(np.fft.rfft(drawn.flow[0, 0, 0]))
    assert spectrum[np.arange(len(spectrum)) % 9 != 0].max() < 1e-9 * spectrum.max()
    shaft = []
    for area in (1e-7, 2e-7):
        bins = {"S": (area, area * (1 + 1e-9))}
        flow = certain.draw(bins, ("S",), 1, np.random.default_rng(0)).flow[0, 0, 0]
        shaft.append(abs(np.fft.rfft(flow))[1])
    assert shaft[1] / shaft[0] == pytest.approx(2.0, rel=0.05)


def test_pistons_of_a_healthy_pump_are_as_unequal_as_those_of_the_recording():
    """A healthy pump one of whose pistons has a small leak of its own, simulated in time. Healthy
    signals have its level between the pistons' orders, order by order, in the mean over draws;
    which piston differs, and by how much, is left to chance."""
    uneven = recorded(Slipper(2e-8, 3))
    between = np.flatnonzero(np.arange(1, 181) % leaking_pump.PISTONS) + 1
    level = np.abs(peak_amplitudes(uneven)[:, between])
    assert np.linalg.norm(level) > 20 * leaking_pump.NOISE
    drawn = source(healthy=uneven).draw({}, ("H",), 200, np.random.default_rng(0)).pressure[0]
    spectra = peak_amplitudes(drawn)[..., between]
    size = np.sqrt(np.mean(np.abs(spectra) ** 2, axis=0))
    assert np.linalg.norm(size) == pytest.approx(np.linalg.norm(level), rel=0.15)
    strong = level > 0.2 * level.max()
    assert np.all(np.abs(np.log(size / level))[strong] < 0.5)
    assert np.abs(spectra.mean(axis=0)).max() < 0.3 * size.max()


def test_model_errors_are_as_large_as_stated_and_smooth(nominal):
    """The factors' root mean square distance from 1 is the stated size at most frequencies, and
    neighbouring orders have nearly the same."""
    rng = np.random.default_rng(2)
    errors = np.array([nominal._smooth(0.2, 2, rng) - 1 for _ in range(400)])
    size = np.sqrt(np.mean(np.abs(errors) ** 2, axis=(0, 1)))
    assert np.sqrt(np.mean(size**2)) == pytest.approx(0.2, rel=0.05)
    assert np.abs(np.diff(errors, axis=-1)).max() < 0.1 * np.abs(errors).max()


def test_twins_are_drawn_from_the_posterior():
    """Coordinates that are drawn have the covariance given, correlations included; numbers of a
    pump that is no part of the twin are drawn as the data sheet's tolerances."""
    twin = Twin(leaking_pump.rig())
    count = len(twin.theta)
    root = np.eye(count)
    root[0, 1] = 0.8
    drawn = source(covariance=root @ root.T)
    rng = np.random.default_rng(0)
    thetas, numbers = zip(*(drawn._draw_twin(rng) for _ in range(4000)))
    assert np.abs(np.cov(np.transpose(thetas)) - root @ root.T).max() < 0.15
    assert np.abs(np.cov(np.transpose(numbers)) - np.eye(len(NUMBERS))).max() < 0.15


def test_what_the_data_sheet_calls_exact_is_no_part_of_the_draw():
    """A wave speed without a tolerance drifts between recordings, which is drawn elsewhere; the
    twins have it as the data sheet says."""
    rig = leaking_pump.rig()
    rig = replace(rig, uncertainty=replace(rig.uncertainty, wave_speed=0.0))
    twin = Twin(rig)
    drawn = source(twin, np.eye(len(twin.theta)))
    theta, _ = drawn._draw_twin(np.random.default_rng(0))
    exact = np.array([p.name.startswith("wave_speed") for p in twin.parameters])
    assert exact.any() and np.all(theta[exact] == 0.0) and np.all(theta[~exact] != 0.0)


def test_fitted_numbers_of_the_pump_are_drawn_with_the_line():
    """A posterior in which dead volume and first wave speed move as one: so do the draws, by as
    much as the posterior says, and the numbers that it knows exactly stay."""
    twin = Twin(leaking_pump.rig(), [leaking_pump.record("a")], uncertain_pump=True)
    direction = np.zeros(len(twin.theta))
    direction[0], direction[twin.index["dead_volume"]] = 1.0, 0.5
    drawn = source(twin, np.outer(direction, direction))
    rng = np.random.default_rng(0)
    thetas, numbers = map(np.array, zip(*(drawn._draw_twin(rng) for _ in range(400))))
    volume = numbers[:, NUMBERS.index("dead_volume")]
    np.testing.assert_allclose(volume, 0.5 * thetas[:, 0], rtol=1e-6, atol=1e-6)
    assert volume.std() == pytest.approx(0.5, rel=0.15)
    others = np.delete(numbers, NUMBERS.index("dead_volume"), axis=1)
    assert np.abs(others).max() < 1e-6


def test_the_pump_of_a_signal_is_drawn_once_for_its_classes(certain, monkeypatch):
    """Certain but for the pump: the healthy flow of every draw differs, a leak's flow less its
    change does not differ from it; an anchored healthy signal knows no pump of the twin."""
    rng = np.random.default_rng(0)
    drawn = iter(np.random.default_rng(1).normal(size=(4, len(NUMBERS))))
    monkeypatch.setattr(certain, "_draw_twin", lambda rng: (certain._line.twin.theta, next(drawn)))
    tiny = {"S": (1e-12, 1.001e-12)}
    flow = certain.draw(tiny, ("H", "S"), 2, rng).flow
    size = np.linalg.norm(flow[0, 0])
    assert np.linalg.norm(flow[0, 1] - flow[0, 0]) > 0.05 * size
    assert np.linalg.norm(flow[1] - flow[0]) < 1e-3 * size
    healthy = certain.draw({}, ("H",), 2, rng, anchored=True).pressure
    np.testing.assert_allclose(healthy[0, 0], healthy[0, 1])


@pytest.mark.parametrize(
    ("ranges", "limit"),
    [(RANGES, 3e-6), (RANGES, 5e-8), ({"S": [2e-6, 1e-7], "C": [1e-7, 2e-6]}, 4e-7)],
)
def test_wrong_ranges_are_refused(ranges, limit):
    """A limit outside the cylinder's range, and a range that falls."""
    with pytest.raises(ValueError, match="must"):
        severity_bins(ranges, limit)
