"""Fits of one effect at a time."""

from types import SimpleNamespace

import numpy as np
import pytest

from made_fits import made_fit
from rippletwin.calibration.frequency_continuation import refine
from rippletwin.explanation.fit_jobs import Workers
from rippletwin.explanation.search.single_effects import _add_usual_effects, fit_single_effects
from rippletwin.explanation.thresholds import MIN_LOG_BAYES_FACTOR
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.twin import Twin
from synthetic_effects import AIR, TRUTH
from synthetic_observations import POINTS, make, rig

FRICTION = (EFFECTS["unsteady_friction"], Place("line"))
WALLS = (EFFECTS["viscoelastic_wall"], Place("line"))


@pytest.mark.parametrize("seed", [1, 2])
def test_a_little_air_gets_the_evidence_of_the_truth(seed):
    """There is 0.15 % of air and one operating point. The line without air absorbs nearly all of
    the air's influence (1) or most of it (2). The search nevertheless gives the air at least the
    log evidence of a fit from the truth."""
    values = TRUTH | {"entrained_air@line.gas_fraction": 1.5e-3}
    one = {"sensors": 2, "points": POINTS[:1], "source": 0.005, "noise": 500.0}
    bench, data, truth = make(np.random.default_rng(seed), AIR, values, **one)
    workers = Workers(Twin(bench, data), data)
    known = refine(workers.base, AIR, data, [truth.theta])
    base, _, (air,) = fit_single_effects(workers, AIR)
    assert known.evidence - base.evidence > MIN_LOG_BAYES_FACTOR
    assert air.evidence > known.evidence - 0.5


@pytest.mark.parametrize(
    ("friction", "walls", "both", "chosen"),
    [
        (50.0, 60.0, 160.0, {FRICTION, WALLS}),
        (50.0, 60.0, 50.0, {FRICTION}),  # beside friction the walls add less than 8
        (20.0, 60.0, 56.0, {WALLS}),  # beside the walls the data are against friction
        (5.0, 7.0, 30.0, {FRICTION, WALLS}),  # neither adds 8 alone
        (5.0, 7.0, 7.5, set()),
    ],
)
def test_sets_of_usual_effects_are_compared(friction, walls, both, chosen):
    """The walls must add 8 of log evidence, and the set 8 to the line. Friction is in every line
    unless the data are 20 to 1 against it. What one adds alone decides nothing."""
    values = {(FRICTION,): friction, (WALLS,): walls}

    def fit(jobs):
        return [made_fit(values.get(job.hypothesis, both), *job.hypothesis) for job in jobs]

    workers = SimpleNamespace(base=SimpleNamespace(rig=rig()), fit=fit)
    alone = fit([SimpleNamespace(hypothesis=(c,)) for c in (FRICTION, WALLS)])
    found = _add_usual_effects(workers, made_fit(0.0), alone)
    assert set(found.hypothesis) == chosen
