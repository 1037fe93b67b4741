"""Free corrections along the line, and the relation between three sensors."""

from dataclasses import replace

import numpy as np

from rippletwin.calibration.frequency_continuation import fit_hypothesis, refine
from rippletwin.explanation.localise.free_corrections import locate_mismatch
from rippletwin.explanation.localise.residual_bands import interior_misfit
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.twin import Twin
from synthetic_observations import make

LEAK = ((EFFECTS["leak"], Place("position")),)
TRUTH = {"leak@position.position": 5.0, "leak@position.conductance": 4e-11}


def test_the_position_profile_peaks_at_the_leak():
    """The scan of free corrections of the base fit peaks within 0.3 m of the true leak."""
    bench, observations, _ = make(np.random.default_rng(7), LEAK, TRUTH)
    base = fit_hypothesis(Twin(bench, observations), (), observations)
    kind, low, high = locate_mismatch(base, observations).profile.best_interval()
    assert kind == "shunt"
    assert low - 0.3 < 5.0 < high + 0.3


def test_the_inner_pressure_follows_from_the_outer_ones_for_any_source_and_load():
    """p2 follows from p1 and p3 in noise-free data of another source and another load."""
    bench, observations, truth = make(np.random.default_rng(8), source=0.5, noise=0.0)
    fit = refine(Twin(bench, observations), (), observations, [truth.theta])
    for misfit in interior_misfit(replace(fit, twin=truth), observations):
        assert np.max(misfit) < 1e-6
