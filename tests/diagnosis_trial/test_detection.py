"""Detection curves: thresholds, and recovery of a known curve."""

import numpy as np
import pytest
from scipy.special import expit

from diagnosis_trial.detection import alarm_threshold, detect_leaks, fit_curve, smallest_found


def test_at_most_the_stated_share_of_healthy_recordings_raises_the_alarm():
    """The threshold is the least that keeps it, also where suspicions are infinite or equal."""
    rng = np.random.default_rng(0)
    for count in (10, 40, 101):
        healthy = rng.standard_normal(count)
        threshold = alarm_threshold(healthy)
        assert np.mean(healthy > threshold) <= 0.05
        below = np.sort(healthy)[np.searchsorted(np.sort(healthy), threshold) - 1]
        assert np.mean(healthy > below) > 0.05
    assert alarm_threshold([np.inf] * 3 + [0.0] * 17) == np.inf


def test_the_curve_that_made_hits_and_misses_is_found():
    """Of 2000 recordings, the middle to 5 % and the slope to 15 %."""
    rng = np.random.default_rng(1)
    severity = 10 ** rng.uniform(-3, 0, 2000)
    detected = rng.uniform(size=2000) < expit(4.0 * (np.log10(severity) + 1.7))
    curve = fit_curve(severity, detected)
    assert 10**curve.middle == pytest.approx(10**-1.7, rel=0.1)
    assert curve.slope == pytest.approx(4.0, rel=0.15)
    assert curve.probability(curve.severity(0.9)) == pytest.approx(0.9)


def test_the_interval_over_rigs_holds_the_true_smallest_leak():
    """In at least 17 of 20 trials of 30 rigs with 4 recordings each, at 50 % detection. No healthy
    recording is near the alarm."""
    rng = np.random.default_rng(2)
    inside = 0
    for _ in range(20):
        severity = 10 ** rng.uniform(-3, 0, 120)
        rigs = np.repeat(np.arange(30), 4)
        middle = -1.7 + 0.3 * rng.standard_normal(30)[rigs]  # rigs differ
        detected = rng.uniform(size=120) < expit(6.0 * (np.log10(severity) - middle))
        leaks = made_leaks(rigs, np.where(detected, 1.0, -1.0), np.arange(30), np.zeros(30))
        value, low, high = smallest_found(leaks, severity, 0.5, rng)
        assert low < value < high
        inside += low < 10**-1.7 < high
    assert inside >= 17


def made_leaks(rigs, suspicions, healthy_rigs, healthy):
    """Leaks of rigs (N,) and healthy recordings of others (H,), of these suspicions."""
    rows = [{"state": "slipper", "rig": r, "suspicion": s} for r, s in zip(rigs, suspicions)]
    rows += [{"state": "healthy", "rig": r, "suspicion": s} for r, s in zip(healthy_rigs, healthy)]
    return detect_leaks(rows, "slipper")


def test_the_interval_counts_that_the_alarm_is_of_few_healthy_recordings():
    """Suspicion rises with severity without scatter, so that a known alarm would leave no interval.
    The alarm is the third of forty scattered healthy recordings: the interval is about that of its
    order statistic."""
    rng = np.random.default_rng(3)
    severity, rigs = 10 ** rng.uniform(-3, 0, 160), np.repeat(np.arange(40), 4)
    healthy = rng.normal(-2.0, 0.3, 40)
    leaks = made_leaks(rigs, np.log10(severity), np.arange(40), healthy)
    value, low, high = smallest_found(leaks, severity, 0.5, rng)
    assert value == pytest.approx(10 ** np.sort(healthy)[-3], rel=0.15)
    thresholds = [alarm_threshold(rng.choice(healthy, 40)) for _ in range(2000)]
    spread = np.ptp(np.quantile(thresholds, [0.025, 0.975]))
    assert np.log10(high / low) == pytest.approx(spread, rel=0.4)


def test_few_recordings_give_no_curve():
    """Fewer than five; and all found gives a curve that says so, with a finite slope."""
    assert fit_curve([0.1, 0.2], [True, False]) is None
    curve = fit_curve(np.geomspace(0.01, 1, 20), np.ones(20, bool))
    assert curve.probability(np.array([0.1])) > 0.8 and curve.slope < 100
