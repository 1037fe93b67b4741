"""The scan of free corrections along the line."""

import numpy as np

from rippletwin.calibration.frequency_continuation import fit_hypothesis
from rippletwin.explanation.localise.free_corrections import locate
from rippletwin.twin.twin import Twin
from synthetic_effects import LEAK, TRUTH
from synthetic_observations import make


def test_profile_peaks_at_the_leak():
    """The scan around the fit without effects finds a shunt within 0.3 m of the true leak."""
    bench, observations, _ = make(np.random.default_rng(7), LEAK, TRUTH)
    base = fit_hypothesis(Twin(bench, observations), (), observations)
    kind, low, high = locate(base, observations).profile.interval()
    assert kind == "shunt"
    assert low - 0.3 < 5.0 < high + 0.3
