"""Fits of one effect at a time."""

import numpy as np
import pytest

from rippletwin.calibration.frequency_continuation import refine
from rippletwin.explanation.fit_jobs import Workers
from rippletwin.explanation.search.single_effects import fit_single_effects
from rippletwin.explanation.thresholds import MIN_LOG_BAYES_FACTOR
from rippletwin.twin.twin import Twin
from synthetic_effects import AIR, TRUTH
from synthetic_observations import POINTS, make


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
