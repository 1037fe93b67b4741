"""Fits of hypotheses: recovery from the data sheet, and the exact mode."""

import numpy as np
import pytest

from rippletwin.calibration.error_sizes import MIN_MODEL_ERROR
from rippletwin.calibration.frequency_continuation import fit_hypothesis, refine
from rippletwin.calibration.posterior import Posterior
from rippletwin.explanation.fit_starts import scan_starts
from rippletwin.twin.twin import Twin
from synthetic_effects import AIR, HOSE, LEAK, MUCH_AIR, TRUTH, VOLUME
from synthetic_observations import make


@pytest.mark.parametrize("hypothesis", [VOLUME, HOSE, LEAK], ids=["volume", "hose", "leak"])
def test_continuation_recovers_the_truth_from_the_data_sheet(hypothesis):
    """The data sheet is wrong by its stated uncertainty. Of three rigs, the fit from there has the
    log evidence of one from the truth in two at least, and the effect's parameters lie within four
    standard deviations of it. The posterior has many modes: one start does not always reach the
    highest, and a search begins at several."""
    assert sum(is_recovered(hypothesis, seed) for seed in (11, 12, 13)) >= 2


def is_recovered(hypothesis, seed: int) -> bool:
    """Whether the fit from the data sheet of one rig finds the truth."""
    bench, observations, truth = make(np.random.default_rng(seed), hypothesis, TRUTH)
    base = Twin(bench, observations)
    fit = fit_hypothesis(base, hypothesis, observations, scan_starts(bench, hypothesis))
    known = refine(base, hypothesis, observations, [truth.theta])
    own = [truth.index[p.name] for p in truth.parameters if "@" in p.name]
    distance = np.abs(fit.twin.theta - truth.theta)[own]
    return bool(
        fit.model_error < 2 * MIN_MODEL_ERROR
        and fit.evidence > known.evidence - 1.0
        and np.all(distance < 4 * fit.sd[own])
    )


def test_refinement_from_one_start_ends_exactly_at_the_mode():
    """The line holds 0.8 % of air. No step of half a standard deviation, in 20 directions of the
    covariance, lowers the objective by more than 1.5. With derivatives of the frozen compliance
    alone some lower it by 2.6. Where the descent ends is known to about 0.3: outflows are solved to
    a tolerance, and starts that differ by 1e-9 end 0.2 to 1.0 above the least of the directions."""
    rng = np.random.default_rng(3)
    bench, observations, truth = make(rng, AIR, MUCH_AIR)
    fit = refine(Twin(bench, observations), AIR, observations, [truth.theta])
    posterior, theta = Posterior(fit.twin, observations), fit.twin.theta
    here = posterior.predict(theta)
    posterior.estimate_errors(here, theta)
    root = np.linalg.cholesky(fit.covariance)
    for draw in rng.normal(size=(20, len(theta))):
        step = 0.5 * root @ draw / np.linalg.norm(draw)
        for moved in (theta - step, theta + step):
            value = posterior.objective(moved, posterior.predict(moved))
            assert value > posterior.objective(theta, here) - 1.5
