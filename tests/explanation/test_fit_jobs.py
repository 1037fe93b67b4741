"""Fit jobs: where each kind of start begins, what it fits, and in which order jobs run."""

from dataclasses import replace

import numpy as np
import pytest

from made_fits import made_fit
from rippletwin.explanation import fit_jobs
from rippletwin.explanation.fit_jobs import (
    Continuation,
    FitJob,
    FromTheta,
    NearFit,
    Workers,
    job_from,
    open_workers,
    progress_callback,
)
from rippletwin.explanation.fit_starts import scan_starts
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.twin import Twin
from synthetic_observations import POINTS, make

GAIN = ((EFFECTS["sensor_gain"], Place("sensor p2", 1)),)
LEAK = ((EFFECTS["leak"], Place("position")),)


@pytest.fixture(scope="module")
def workers():
    """Workers in this process, of a line without effects at two operating points."""
    bench, observations, _ = make(np.random.default_rng(3), points=POINTS[:2])
    return Workers(Twin(bench, observations), observations)


@pytest.fixture
def calls(monkeypatch):
    """What the two ways to fit were called with, in order: (name, base, observations, ...)."""
    recorded = []

    def fit_hypothesis(base, hypothesis, observations, starts, source_free, draws):
        recorded.append(("continuation", base, observations, list(starts), source_free, draws))
        return made_fit(0.0, *hypothesis)

    def refine(base, hypothesis, observations, thetas, source_free, exact, **options):
        recorded.append(("refine", base, observations, thetas, source_free, exact))
        return made_fit(0.0, *hypothesis)

    monkeypatch.setattr(fit_jobs, "fit_hypothesis", fit_hypothesis)
    monkeypatch.setattr(fit_jobs, "refine", refine)
    return recorded


def test_a_job_without_a_start_scans_its_newest_effect(workers, calls):
    """By default a hypothesis is fitted by continuation from the scan of its newest effect, which
    for a position has several starts; given starts and draws take its place."""
    workers.fit([FitJob(LEAK)])
    workers.fit([FitJob(LEAK, Continuation(({"leak@position.position": 0.5},), draws=7))])
    (name, base, observations, starts, source_free, draws), given = calls
    assert (name, source_free, draws) == ("continuation", False, 0)
    assert base is workers.base and observations == workers.observations
    assert starts == scan_starts(workers.base.rig, LEAK) and len(starts) > 5
    assert given[3:] == ([{"leak@position.position": 0.5}], False, 7)


def test_a_job_may_have_its_own_base_and_observations(workers, calls):
    """A fold fits some of the observations; a job with other priors brings a base of its own."""
    other = Twin(workers.base.rig, workers.observations)
    theta = np.ones(len(other.theta))
    job = FitJob((), FromTheta(theta, exact=False), (1,), other, source_free=True)
    workers.fit([job])
    ((name, base, observations, thetas, source_free, exact),) = calls
    assert name == "refine" and base is other and observations == [workers.observations[1]]
    assert thetas == [theta] and source_free and not exact


def test_a_part_of_the_recordings_is_its_own_reference(workers, calls):
    """Where recordings have states, the viscosity of a fit to some is that at their mean state."""
    base = Twin(workers.base.rig, workers.observations, changing_state=True)
    start = FromTheta(np.zeros(len(base.theta)), exact=False)
    workers.fit([FitJob((), start, (1,), base), FitJob((), start, None, base)])
    assert [base.reference for _, base, *_ in calls] == [["point 2"], None]


def test_a_start_near_a_fit_moves_the_newest_effect_only(workers, calls):
    """All starts have the neighbour's coordinates but for those of the added effect, which starts
    from its scan and, weak, from more positions than the line has wavelengths."""
    rng = np.random.default_rng(1)
    twin = workers.base.with_(effects=GAIN)
    twin = twin.with_(theta=rng.normal(size=len(twin.theta)))
    hypothesis = (*GAIN, *LEAK)
    workers.fit([FitJob(hypothesis, NearFit(replace(made_fit(0.0, *GAIN), twin=twin)))])
    ((_, _, _, thetas, _, exact),) = calls
    extended = workers.base.with_(effects=hypothesis)
    kept = [extended.index[name] for name in twin.index]
    assert not exact
    for theta in thetas:
        np.testing.assert_array_equal(theta[kept], [twin.theta[k] for k in twin.index.values()])
    positions = {theta[extended.index["leak@position.position"]] for theta in thetas}
    highest_hz = max(o.frequency_hz[-1] for o in workers.observations)
    assert len(positions) > twin.rig.delay * highest_hz


def test_long_jobs_run_first_and_fits_keep_the_order_of_their_jobs(workers, calls):
    """A job with many starts runs before a job from one theta, so that no process ends late; the
    fits come in the order in which they were asked for."""
    quick = FitJob(GAIN, FromTheta(np.zeros(len(workers.base.with_(effects=GAIN).theta))))
    done = []
    report = progress_callback(lambda *state: done.append(state), "fits", 2)
    fits = workers.fit([quick, FitJob(LEAK)], report)
    assert [name for name, *_ in calls] == ["continuation", "refine"]
    assert [fit.names for fit in fits] == [("sensor_gain",), ("leak",)]
    assert done == [("fits", 1, 2), ("fits", 2, 2)]


def test_processes_fit_what_one_process_fits(workers):
    """The same jobs in two processes and in this one end at the same modes, and a fit that is
    repeated from its mode stays there."""
    _, _, truth = make(np.random.default_rng(3), points=POINTS[:2])
    jobs = [FitJob((), FromTheta(truth.theta), observations=(k,)) for k in (0, 1)]
    fits = workers.fit(jobs)
    repeated = [job_from(fit, observations=(k,)) for k, fit in enumerate(fits)]
    with open_workers(workers.base, workers.observations, 2) as pool:
        pooled = pool.fit([*jobs, *repeated])
    for fit, same, again in zip(fits, pooled[:2], pooled[2:]):
        np.testing.assert_allclose(same.twin.theta, fit.twin.theta, atol=1e-9)
        assert again.evidence == pytest.approx(fit.evidence, abs=0.1)
    assert fits[0].evidence != pytest.approx(fits[1].evidence, abs=0.1)
