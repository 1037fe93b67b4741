"""The score test on starts along the line."""

import numpy as np
import pytest

from rippletwin.calibration.frequency_continuation import refine
from rippletwin.calibration.multistart import MAX_FOLLOWED, select_by_score_test
from rippletwin.calibration.posterior import Posterior
from rippletwin.explanation.fit_jobs import transfer_theta, weak_effect_starts
from rippletwin.twin.twin import Twin
from synthetic_effects import VOLUME
from synthetic_observations import make


@pytest.mark.parametrize("place", [1.3, 4.4, 7.7])
def test_score_test_keeps_a_start_near_the_true_position(place):
    """The truth has a volume of 0.4 cm3. From a good fit without it, of starts all along the line
    the score test keeps one within an eighth of the shortest wavelength of the true position."""
    values = {"line_volume@position.position": place, "line_volume@position.volume": 4e-7}
    bench, observations, truth = make(np.random.default_rng(6), VOLUME, values, source=0.02)
    base = Twin(bench, observations)
    without = refine(base, (), observations, [truth.theta[: len(base.parameters)]])
    twin = base.with_(effects=VOLUME)
    thetas = []
    for start in weak_effect_starts(bench, VOLUME, 270):
        thetas.append(transfer_theta(without, VOLUME, base))
        for name, u in start.items():
            thetas[-1][twin.index[name]] = u
    kept = select_by_score_test(base, Posterior(twin, observations), thetas)
    positions = [twin.values(theta)["line_volume@position.position"] for theta in kept]
    assert len(kept) == MAX_FOLLOWED
    assert min(abs(x - place) for x in positions) < 1000 / 4000 / 8
