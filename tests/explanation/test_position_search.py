"""Where along the line an effect may sit."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rippletwin.calibration.frequency_continuation import refine
from rippletwin.case.model import Sensor
from rippletwin.explanation.fit_jobs import FitJob, FromTheta, Workers
from rippletwin.explanation.search.position_search import (
    equivalent_positions,
    fit_other_positions,
    move_to_best_position,
    positions_of_effects,
)
from rippletwin.explanation.thresholds import EQUIVALENT_LOG_BAYES_FACTOR, MIN_LOG_BAYES_FACTOR
from rippletwin.spectra.frequency_selection import select_fitted_frequencies
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.twin import Twin
from synthetic_observations import make, rig

LEAK = ((EFFECTS["leak"], Place("position")),)
WALL = (EFFECTS["viscoelastic_wall"], Place("segment 2", 1))


def recorded(position, conductance, seed=1):
    """(pool, fit from the truth) of a leak, at one operating point and two sensors."""
    values = {"leak@position.position": position, "leak@position.conductance": conductance}
    one = {"sensors": 2, "points": ((1000, 9.5e6),), "source": 0.01}
    bench, observations, truth = make(np.random.default_rng(seed), LEAK, values, **one)
    data = select_fitted_frequencies(observations, bench)
    pool = Workers(Twin(bench, data), data)
    return pool, refine(pool.base, LEAK, data, [truth.theta])


@pytest.mark.parametrize("place", [0.6, 3.5])
def test_from_a_wrong_seat_the_true_one_is_found(place):
    """A leak left in another wave of the line, where its descent ends and the data are far less
    likely, is moved to where a fit from the truth ends."""
    pool, known = recorded(1.7, 4e-11)
    theta = known.twin.theta.copy()
    k = known.twin.index["leak@position.position"]
    theta[k] = known.twin.parameters[k].prior.coordinate(place)
    (wrong,) = pool.fit([FitJob(LEAK, FromTheta(theta))])
    assert wrong.evidence < known.evidence - EQUIVALENT_LOG_BAYES_FACTOR
    assert abs(positions_of_effects(wrong)["leak"] - 1.7) > 0.1
    best, others = move_to_best_position(pool, wrong)
    assert best.evidence == pytest.approx(known.evidence, abs=0.5)
    assert positions_of_effects(best)["leak"] == pytest.approx(1.7, abs=0.03)
    assert others == [] and equivalent_positions(best, others) == ()


@pytest.mark.parametrize("seed", [1, 2])
def test_a_weak_leak_is_said_to_be_wherever_it_may_be(monkeypatch, seed):
    """Two sensors downstream do not tell in which wave before them a weak leak is: the fit ends in
    another than the true one, which is among those stated."""
    apart = (Sensor("p1", 5.0), Sensor("p2", 6.5))
    monkeypatch.setattr(
        "synthetic_observations.rig", lambda count: replace(rig(count), sensors=apart)
    )
    pool, known = recorded(0.6, 6e-12, seed)
    base, best = pool.fit([FitJob(()), FitJob(LEAK)])
    assert known.evidence > base.evidence + MIN_LOG_BAYES_FACTOR
    best, others = move_to_best_position(pool, best)
    assert known.evidence - 0.5 < best.evidence < known.evidence + EQUIVALENT_LOG_BAYES_FACTOR
    places = [positions_of_effects(f)["leak"] for f in (best, *others)]
    assert abs(places[0] - 0.6) > 1.0 and min(abs(x - 0.6) for x in places) < 0.03
    (names,) = equivalent_positions(best, others)
    assert len(names) == len(places) > 1 and "leak at 0.6" in " ".join(names)


def test_what_has_no_position_has_no_seats():
    """Nothing is fitted for a wall, nor where the line stores beyond proportion."""
    pool = SimpleNamespace(base=None, fit=lambda jobs: jobs, observations=())
    twin = SimpleNamespace(rig=SimpleNamespace(delay=0.01, length=9.0), values=dict)
    pool.observations = (SimpleNamespace(frequency_hz=np.array([4000.0])),)
    wall = SimpleNamespace(hypothesis=(WALL,), twin=twin, has_nonlinear_compliance=False)
    assert fit_other_positions(pool, wall) == []
    assert (
        move_to_best_position(
            pool, SimpleNamespace(hypothesis=LEAK, twin=twin, has_nonlinear_compliance=True)
        )[1]
        == []
    )
