"""Search over the local modes of an effect's position."""

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


def leak(position, conductance, seed=1):
    """(workers, fit from the truth) of a leak, with one operating point and two sensors."""
    values = {"leak@position.position": position, "leak@position.conductance": conductance}
    one = {"sensors": 2, "points": ((1000, 9.5e6),), "source": 0.01}
    bench, observations, truth = make(np.random.default_rng(seed), LEAK, values, **one)
    data = select_fitted_frequencies(observations, bench)
    workers = Workers(Twin(bench, data), data)
    return workers, refine(workers.base, LEAK, data, [truth.theta])


@pytest.mark.parametrize("place", [0.6, 3.5])
def test_an_effect_at_a_wrong_local_mode_is_moved_to_the_true_one(place):
    """A leak at another local mode, where its fit ends with far less evidence, is moved to where a
    fit from the truth ends."""
    workers, known = leak(1.7, 4e-11)
    theta = known.twin.theta.copy()
    k = known.twin.index["leak@position.position"]
    theta[k] = known.twin.parameters[k].prior.coordinate(place)
    (wrong,) = workers.fit([FitJob(LEAK, FromTheta(theta))])
    assert wrong.evidence < known.evidence - EQUIVALENT_LOG_BAYES_FACTOR
    assert abs(positions_of_effects(wrong)["leak@position"] - 1.7) > 0.1
    best, others = move_to_best_position(workers, wrong)
    assert best.evidence == pytest.approx(known.evidence, abs=0.5)
    assert positions_of_effects(best)["leak@position"] == pytest.approx(1.7, abs=0.03)
    assert others == [] and equivalent_positions(best, others) == ()


@pytest.mark.parametrize("seed", [1, 2])
def test_all_equivalent_positions_of_a_weak_leak_are_stated(monkeypatch, seed):
    """Two sensors downstream do not determine at which wavelength before them a weak leak is. The
    fit ends at a wrong one, and the true one is among those stated."""
    downstream = (Sensor("p1", 5.0), Sensor("p2", 6.5))
    monkeypatch.setattr(
        "synthetic_observations.rig", lambda count: replace(rig(count), sensors=downstream)
    )
    workers, known = leak(0.6, 6e-12, seed)
    base, best = workers.fit([FitJob(()), FitJob(LEAK)])
    assert known.evidence > base.evidence + MIN_LOG_BAYES_FACTOR
    best, others = move_to_best_position(workers, best)
    assert known.evidence - 0.5 < best.evidence < known.evidence + EQUIVALENT_LOG_BAYES_FACTOR
    positions = [positions_of_effects(f)["leak@position"] for f in (best, *others)]
    assert abs(positions[0] - 0.6) > 1.0 and min(abs(x - 0.6) for x in positions) < 0.03
    (names,) = equivalent_positions(best, others)
    assert len(names) == len(positions) > 1 and "leak at 0.6" in " ".join(names)


def test_nothing_is_fitted_without_a_position_or_with_nonlinear_compliance():
    """A wall has no position, and with nonlinear compliance each fit would take too long."""
    workers = SimpleNamespace(base=None, fit=lambda jobs: jobs, observations=())
    twin = SimpleNamespace(rig=SimpleNamespace(delay=0.01, length=9.0), values=dict)
    workers.observations = (SimpleNamespace(frequency_hz=np.array([4000.0])),)
    wall = SimpleNamespace(hypothesis=(WALL,), twin=twin, has_nonlinear_compliance=False)
    assert fit_other_positions(workers, wall) == []
    assert (
        move_to_best_position(
            workers, SimpleNamespace(hypothesis=LEAK, twin=twin, has_nonlinear_compliance=True)
        )[1]
        == []
    )
