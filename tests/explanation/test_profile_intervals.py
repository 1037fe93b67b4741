"""Profile intervals of an explanation's parameters."""

from dataclasses import replace

import numpy as np
import pytest

from rippletwin.calibration.frequency_continuation import refine
from rippletwin.calibration.levenberg_marquardt import descend
from rippletwin.calibration.posterior import Posterior
from rippletwin.explanation.checks import profile_intervals
from rippletwin.explanation.checks.profile_intervals import (
    INTERVAL_RISE,
    MAX_RISE,
    PROFILE_DISTANCES,
    ProfileJob,
    ProfileTrace,
    add_profile_intervals,
    effect_intervals,
    interpolate_crossing,
    trace_profile,
)
from rippletwin.explanation.fit_jobs import Workers
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.twin import Twin
from synthetic_observations import make

HOSE = ((EFFECTS["viscoelastic_wall"], Place("segment 2", 1)),)
TRUTH = {
    "viscoelastic_wall@segment 2.compliance_ratio": 0.2,
    "viscoelastic_wall@segment 2.retardation_time": 3e-4,
}
AT = np.array((0.0, *PROFILE_DISTANCES))


@pytest.fixture(scope="module")
def hose():
    """(workers in this process, fit from the truth)."""
    bench, observations, truth = make(np.random.default_rng(4), HOSE, TRUTH)
    fit = refine(Twin(bench, observations), HOSE, observations, [truth.theta])
    return Workers(Twin(bench, observations), observations), fit


def test_a_parabola_gives_the_interval_of_a_normal_distribution():
    """For a normal posterior the interval ends at 1.96 standard deviations."""
    assert interpolate_crossing(AT, AT**2 / 2) == pytest.approx(1.96, abs=1e-3)


def test_the_interval_contains_a_second_local_mode():
    """The interval ends at the last crossing, beyond a second mode, or at the last point of the
    profile if there is no crossing."""
    assert 4.0 < interpolate_crossing(AT, np.array([0.0, 1.1, 3.0, 0.5, 9.0])) < 6.0
    assert interpolate_crossing(AT, np.array([0.0, 0.1, 0.2, 0.3, 0.4])) == PROFILE_DISTANCES[-1]


@pytest.mark.parametrize("side", [-1, 1])
def test_the_log_posterior_has_fallen_by_the_quantile_at_the_interval_end(hose, side):
    """With one parameter fixed at the interval's end and the rest refitted from the mode, minus the
    log posterior is INTERVAL_RISE above the mode's: a few points of the profile suffice."""
    workers, fit = hose
    k = fit.twin.index["viscoelastic_wall@segment 2.compliance_ratio"]
    end = trace_profile(workers.base, workers.observations, ProfileJob(fit, k, side)).end
    theta = fit.twin.theta.copy()
    theta[k] = end
    posterior = Posterior(fit.twin, workers.observations)
    value = descend(posterior, theta, 30, fixed=[k])[1]
    assert value - fit.objective == pytest.approx(INTERVAL_RISE, abs=0.2 * INTERVAL_RISE)
    assert side * (end - fit.twin.theta[k]) > 0


def test_intervals_contain_the_truth_and_a_fixed_parameter_stays(hose):
    """The interval of each parameter contains its true value, in the verdict's units. A descent
    does not move a fixed parameter."""
    workers, fit = hose
    (entry,) = effect_intervals(add_profile_intervals(workers, fit))
    for name, parameter in entry["parameters"].items():
        low, high = parameter["ci95"]
        assert low < parameter["value"] < high
        assert low < TRUTH[f"viscoelastic_wall@segment 2.{name}"] < high
    start = fit.twin.theta + 0.1
    theta, _ = descend(Posterior(fit.twin, workers.observations), start, 3, fixed=[2])
    assert theta[2] == start[2] and np.all(theta[:2] != start[:2])


def test_a_better_mode_on_a_profile_replaces_the_fit(hose):
    """Where a profile finds a better point, the fit is repeated from it and profiled again."""
    _, fit = hose
    better = replace(fit, objective=fit.objective - 10.0)
    far = fit.twin.theta + 1.0

    class StubWorkers:
        def map(self, function, jobs):
            left = [job.fit.objective for job in jobs]
            new = left[0] == better.objective
            value = better.objective if new else better.objective + MAX_RISE
            return [ProfileTrace(job.side * (2.0 if new else 1.0), value, far) for job in jobs]

        def fit(self, jobs):
            assert np.array_equal(jobs[0].start.theta, far)
            return [better]

    found = add_profile_intervals(StubWorkers(), fit)
    assert found.objective == better.objective
    assert set(found.interval_ends.values()) == {(-2.0, 2.0)}


def test_a_better_mode_that_cannot_be_fitted_is_left(hose):
    """A profile passes a better point, but the fit from there fails: the intervals are those of the
    fit that is there."""
    _, fit = hose
    failed = replace(fit, objective=np.inf)

    class StubWorkers:
        def map(self, function, jobs):
            assert all(job.fit is fit for job in jobs)
            value = fit.objective - 10.0
            return [ProfileTrace(job.side * 1.0, value, fit.twin.theta) for job in jobs]

        def fit(self, jobs):
            return [failed]

    found = add_profile_intervals(StubWorkers(), fit)
    assert found.objective == fit.objective
    assert set(found.interval_ends.values()) == {(-1.0, 1.0)}


@pytest.mark.parametrize(
    ("rises", "distance"),
    [([], 1.96), ([0.1], 1.96), ([0.1, 0.2, 0.3], 4.0), ([2.0 * INTERVAL_RISE], 1.06)],
)
def test_an_interval_does_not_end_where_the_fits_fail(hose, monkeypatch, rises, distance):
    """The line has no prediction beyond the last of the `rises`. The interval then ends at least
    where the curvature puts it, unless the profile has ended it before."""
    workers, fit = hose
    k = fit.twin.index["viscoelastic_wall@segment 2.compliance_ratio"]

    def descend_to(posterior, theta, steps, fixed, errors=True):
        return theta, next(values) if errors else 0.0

    monkeypatch.setattr(profile_intervals, "descend", descend_to)
    for side in (-1, 1):
        values = iter([fit.objective + rise for rise in rises] + [np.inf])
        end = trace_profile(workers.base, workers.observations, ProfileJob(fit, k, side)).end
        assert side * (end - fit.twin.theta[k]) / fit.sd[k] == pytest.approx(distance, rel=0.01)
