"""The factor on the data sheet's tolerances."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from paper_rig import paper_rig
from rippletwin.explanation.fit_jobs import Continuation, FitJob, FromTheta, Workers
from rippletwin.explanation.search import sheet_tolerance
from rippletwin.explanation.search.sheet_tolerance import (
    SCALES,
    estimate_tolerance_scale,
    evidence_of_scales,
    fit_with_wider_tolerances,
    scale_tolerances,
)
from rippletwin.twin.twin import Twin
from synthetic_observations import make


def test_the_evidence_is_that_of_the_data_under_each_prior():
    """Proves the closed form: data y = A u + noise with u ~ N(0, k^2) are Gaussian, and their log
    density as a multivariate normal gives the same differences between the scales."""
    rng = np.random.default_rng(1)
    a, y = rng.normal(size=(7, 4)), rng.normal(size=7) * 3.0
    covariance = np.linalg.inv(a.T @ a + np.eye(4))
    evidence = evidence_of_scales(covariance @ a.T @ y, covariance)
    densities = []
    for k in SCALES:
        total = np.eye(7) + k**2 * a @ a.T
        densities.append(-0.5 * (y @ np.linalg.solve(total, y) + np.linalg.slogdet(total)[1]))
    assert evidence == pytest.approx(np.array(densities) - densities[0], abs=1e-9)


def test_numbers_twice_as_far_off_double_the_tolerances():
    """Proves that the scale is found: of forty numbers that the data determine, drawn with twice
    their stated deviation, the likeliest scale is near 2; drawn as stated it is near 1."""
    rng = np.random.default_rng(2)
    for true in (1.0, 2.0):
        covariance = 0.01 * np.eye(40)
        evidence = evidence_of_scales(true * rng.normal(size=40), covariance)
        assert SCALES[int(np.argmax(evidence))] == pytest.approx(true, rel=0.2)


def test_all_tolerances_are_scaled_but_that_of_the_sensors_gain():
    """Proves that the rig tells how much wider its tolerances are, also when scaled again."""
    rig = paper_rig(2)
    wide = scale_tolerances(scale_tolerances(rig, 2.0), 1.5)
    assert wide.tolerance_scale == 3.0
    assert wide.uncertainty.diameter == pytest.approx(3.0 * rig.uncertainty.diameter)
    assert wide.uncertainty.sensor_gain == rig.uncertainty.sensor_gain


@pytest.mark.parametrize(("so_far", "found"), [(1.0, 4.0), (2.0, 2.0), (4.0, 1.0)])
def test_the_tolerances_never_get_more_than_four_times_as_wide(so_far, found):
    """Proves that a line whose physics is left out does not widen its data sheet without end: of
    numbers twenty deviations off, each fit would ask for the largest factor again."""
    twin = SimpleNamespace(
        parameters=[SimpleNamespace(is_sheet_number=True)] * 6,
        theta=np.full(6, 20.0),
        rig=SimpleNamespace(tolerance_scale=so_far),
    )
    fit = SimpleNamespace(twin=twin, evidence=0.0, covariance=0.01 * np.eye(6))
    assert estimate_tolerance_scale(fit) == pytest.approx(found)


@pytest.fixture(scope="module")
def plain_fit():
    """A line without effects, fitted, and the workers for its observations."""
    rig, observations, truth = make(np.random.default_rng(3), points=((1000, 9.5e6),))
    workers = Workers(Twin(rig, observations), observations)
    (fit,) = workers.fit([FitJob((), FromTheta(truth.theta))])
    return fit, workers


@pytest.mark.parametrize(
    ("wide", "stated", "taken"),
    [
        ((-9.0, -3.0), None, None),  # nothing to learn from: no third fit
        ((2.9, 1.0), 0.0, None),
        ((3.0, 1.0), 0.0, 3.0),
        ((3.5, 20.0), 16.0, 20.0),
        ((3.5, 20.0), 18.0, 18.0),  # the better mode needs no wider tolerances
        ((-9.0, -2.0), 1.0, 1.0),
    ],
)
def test_wider_tolerances_are_taken_where_they_gain(plain_fit, monkeypatch, wide, stated, taken):
    """Proves that wider tolerances are taken from 3 of log evidence on over those stated, the mode
    being the same, and that a better mode which they find is taken in either case. The wider ones
    are twice the data sheet's, because the fit itself asks for none."""
    fit, workers = plain_fit
    monkeypatch.setattr(sheet_tolerance, "estimate_tolerance_scale", lambda fit: 1.0)
    asked = []

    def run(jobs):
        asked.append(jobs)
        gains = wide if len(asked) == 1 else [stated]
        return [replace(fit, evidence=fit.evidence + gain) for gain in gains]

    found = fit_with_wider_tolerances(
        SimpleNamespace(observations=workers.observations, fit=run), fit
    )
    assert [job.base.rig.tolerance_scale for job in asked[0]] == [2.0, 2.0]
    assert [type(job.start) for job in asked[0]] == [FromTheta, Continuation]
    assert (len(asked) == 1) == (stated is None)
    assert (found is None) == (taken is None)
    if taken is not None:
        assert found.evidence == pytest.approx(fit.evidence + taken)


def test_tolerances_four_times_as_wide_are_not_widened(plain_fit):
    """Proves that nothing is fitted where the tolerances are as wide as they may get."""
    fit, workers = plain_fit
    rig = replace(fit.twin.rig, tolerance_scale=4.0)
    widest = replace(fit, twin=Twin(rig, workers.observations).with_(theta=fit.twin.theta))
    assert fit_with_wider_tolerances(None, widest) is None
