"""Alarms of the base fit and of the two halves of a recording."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import chi2

from rippletwin.calibration.frequency_continuation import refine
from rippletwin.explanation.checks import alarms as rules
from rippletwin.explanation.checks.alarms import (
    HALVES_MODEL_ERROR,
    RESONANCE_PASSAGES,
    Alarms,
    aligned_difference,
    at_common_orders,
    drift_p_value,
    evidence_p_value,
    fit_each_observation,
    largest_disagreement,
    largest_pull,
    read_alarms,
)
from rippletwin.explanation.localise.elements import NONE
from rippletwin.explanation.thresholds import (
    DISAGREEMENT_ALARM,
    DRIFT_SIGNIFICANCE,
    MIN_LOG_BAYES_FACTOR,
    PULL_ALARM,
)
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.twin import Twin
from synthetic_observations import make


def test_drift_is_detected_and_noise_is_not():
    """Two noisy recordings of one state agree. With a wave speed that differs by half its prior
    deviation they do not."""
    rng = np.random.default_rng(9)
    _, early, truth = make(rng, source=0.0)
    changed = truth.theta.copy()
    changed[truth.index["wave_speed[1]"]] += 0.5

    def record(theta):
        recorded = []
        for o, h in zip(early, ForwardModel(truth, early)(theta)):
            noise = rng.normal(size=(*h.shape, 2)) @ np.array([1, 1j]) / np.sqrt(2)
            recorded.append(replace(o, values=h + noise * np.sqrt(o.covariance[0, 0, 0].real)))
        return recorded

    assert drift_p_value(early, record(truth.theta), truth.rig.delay)[0] > 0.01
    assert drift_p_value(early, record(changed), truth.rig.delay)[0] < 1e-6


def test_the_pull_names_the_parameter_farthest_from_the_data_sheet():
    """Of a fit with one coordinate at -5 and all others at 0, that one is named, with 5."""
    bench, observations, truth = make(np.random.default_rng(10))
    fit = refine(Twin(bench, observations), (), observations, [truth.theta])
    theta = np.zeros_like(fit.twin.theta)
    theta[fit.twin.index["diameter[2]"]] = -5.0
    moved = replace(fit, twin=fit.twin.with_(theta=theta))
    assert largest_pull(moved) == (5.0, "diameter[2]")


QUIET = Alarms(0.0, (0.0, ""), (0.0, ""), (1.0, ""))


@pytest.mark.parametrize(
    ("changed", "raised"),
    [
        ({"misfit": MIN_LOG_BAYES_FACTOR}, ("misfit",)),
        ({"misfit": MIN_LOG_BAYES_FACTOR - 1e-9}, ()),
        ({"pull": (PULL_ALARM, "")}, ()),
        ({"pull": (PULL_ALARM + 1e-9, "")}, ("pull",)),
        ({"disagreement": (DISAGREEMENT_ALARM, "")}, ()),
        ({"disagreement": (DISAGREEMENT_ALARM + 1e-9, "")}, ("disagreement",)),
        ({"drift": (DRIFT_SIGNIFICANCE, "")}, ()),
        ({"drift": (DRIFT_SIGNIFICANCE / 2, "")}, ("drift",)),
    ],
)
def test_each_alarm_is_raised_beyond_its_limit(changed, raised):
    assert replace(QUIET, **changed).raised == raised


def made_point(sd=0.1, **values):
    """A fit of one operating point: coordinates by name, all with one standard deviation; `flat`
    has no prior, `leak__position` is that of the effect leak@line."""
    names = list(values)
    parameters = tuple(
        SimpleNamespace(
            name=n.replace("__", "@line."),
            flat=n == "flat",
            place=n.partition("__")[0] + "@line" if "__" in n else "line",
        )
        for n in names
    )
    twin = SimpleNamespace(
        parameters=parameters,
        effects=[(SimpleNamespace(name="leak"), "line")],
        index={p.name: k for k, p in enumerate(parameters)},
        theta=np.array(list(values.values())),
    )
    return SimpleNamespace(twin=twin, covariance=sd**2 * np.eye(len(names)))


def test_disagreement_is_in_standard_deviations_of_the_difference():
    """Variances 0.01 and 0.04 of posteriors that share a unit prior: each counts with what the data
    alone add, v (1 - v), and 1e-4 for numerics. Parameters without a prior, of effects, and of one
    point alone are passed over, whatever stands behind them."""
    a = made_point(0.1, flat=0.0, leak__position=0.0, only=0.0, length=1.0, bore=0.0)
    b = made_point(0.2, flat=9.0, leak__position=9.0, bore=0.1, length=0.5)
    expected = 0.5 / np.sqrt(0.01 * 0.99 + 0.04 * 0.96 + 1e-4)
    found = largest_disagreement([a, b])
    assert found == (pytest.approx(expected), "length")
    assert largest_disagreement([made_point(length=1.0), b, a])[1] == "length"
    assert largest_disagreement([a]) == (0.0, "")


def test_an_at_sign_in_a_name_is_no_effect():
    """The drift of a recording with the legal label hot@95bar, and the place of a sensor p@2, are
    parameters of the line."""
    for name in ("state[hot@95bar]", "position[p@2]"):
        found = largest_disagreement([made_point(**{name: 1.0}), made_point(**{name: 0.0})])
        assert found[0] > 1.0 and found[1] == name
    bench, seen, _ = make(np.random.default_rng(10))
    sensors = tuple(replace(s, name=f"{s.name}@2") for s in bench.sensors)
    twin = Twin(replace(bench, sensors=sensors), [replace(o, sensors=sensors) for o in seen])
    theta = np.zeros_like(twin.theta)
    name = f"position[{sensors[0].name}]"
    theta[twin.index[name]] = -5.0
    assert largest_pull(SimpleNamespace(twin=twin.with_(theta=theta))) == (5.0, name)


def test_a_posterior_wider_than_its_prior_adds_no_variance():
    """Of a parameter that the data do not determine, v = 1, only numerics are left."""
    a, b = made_point(1.0, length=1e-2), made_point(1.2, length=0.0)
    assert largest_disagreement([a, b])[0] == pytest.approx(1e-2 / np.sqrt(1e-4))


def test_one_recording_has_no_point_to_compare():
    """A single observation is not fitted alone; of three each is."""
    asked = []
    base = SimpleNamespace(twin=SimpleNamespace(theta=np.zeros(2)))
    workers = SimpleNamespace(observations=[1], fit=lambda jobs: asked.extend(jobs) or ["fits"])
    assert fit_each_observation(workers, base) == [] and not asked
    workers.observations = [1, 2]
    assert fit_each_observation(workers, base) == ["fits"]
    assert [(job.hypothesis, job.observations) for job in asked] == [((), (0,)), ((), (1,))]


def test_the_misfit_alarm_is_what_the_best_correction_adds(monkeypatch):
    """The largest log evidence of any element less that without a correction."""
    table = {(NONE, None): -50.0, ("segment", 1): -20.0, ("shunt", 2.0): -45.0}

    class Corrections:
        def __init__(self, *arguments):
            pass

        def by_element(self, elements):
            assert elements == ["listed", "promising"]
            return table

        def promising_positions(self):
            return ["promising"]

    monkeypatch.setattr(rules, "SmoothCorrections", Corrections)
    monkeypatch.setattr(rules, "elements_of", lambda rig, observations: ["listed"])
    rig = SimpleNamespace(tolerance_scale=1.0)
    base = SimpleNamespace(twin=SimpleNamespace(rig=rig, parameters=(), theta=(), effects=()))
    assert read_alarms(base, [], [], [], [], 0.0).misfit == 30.0


def halves(turn, speed=1.0):
    """Two halves of one state without noise: orders 9 and 18 and 27, of which the first half lacks
    the last; the second is turned by `turn` (rad of the shaft) and `speed` times as fast."""
    _, (late, *_), _ = make(np.random.default_rng(1))
    late = replace(rules.select_frequencies(late, slice(0, 3)), speed_hz=10.0)
    values = np.array([[1.0, 0.5j, 0.2], [0.3, 1.0, 0.1], [0.1, 0.2, 1.0]]) * 1e5
    early = rules.select_frequencies(replace(late, values=values), slice(0, 2))
    turned = values * np.exp(1j * turn * np.asarray(late.orders))
    return early, replace(late, values=turned, speed_hz=10.0 * speed)


def test_halves_are_compared_at_the_orders_of_both():
    early, late = at_common_orders(*halves(0.0))
    assert early.orders.tolist() == late.orders.tolist() == [9, 18]
    assert np.array_equal(early.values, late.values)


@pytest.mark.parametrize("turn", [0.0, 0.2, -0.3])
def test_another_shaft_angle_is_no_drift(turn):
    """The second half begins at another angle of the shaft: what is left of 1e5 Pa is nothing."""
    difference, _ = aligned_difference(*at_common_orders(*halves(turn)), delay=0.01)
    assert np.max(np.abs(difference)) < 1e-3


def test_the_angle_follows_the_orders_that_are_known():
    """The second of two orders has noise a hundred times its value and another phase. The first,
    without noise, is aligned to 1 % of its value."""
    early, late = at_common_orders(*halves(0.2))
    noise = np.einsum("f,ij->fij", [1.0, 1e14], np.eye(len(early.values)))
    wrong = late.values * np.array([1.0, -1.0])
    late = replace(late, values=wrong, covariance=noise)
    difference, _ = aligned_difference(replace(early, covariance=noise), late, delay=0.0)
    assert np.max(np.abs(difference[:, 0])) < 1e3


def test_what_one_state_allows():
    """Noise of both halves, a model error of the mean power over the sensors, and the phase that a
    sharp resonance changes by at another speed."""
    early, late = at_common_orders(*halves(0.1, speed=1.001))
    _, variance = aligned_difference(early, late, delay=0.01)
    phase = 2 * np.pi * early.frequency_hz * RESONANCE_PASSAGES * 0.01 * (1 - 1 / 1.001)
    power = np.mean(np.abs(early.values) ** 2, axis=0)
    noise = early.variance + late.variance
    assert variance == pytest.approx(noise + (HALVES_MODEL_ERROR**2 + phase**2) * power)


def test_the_p_value_of_a_drift_counts_every_recording():
    """Halves that differ by as much as one state allows in each real number have the p-value of
    chi-squared, less a degree of freedom for the angle, times the number of recordings; 1 at most.
    A recording without orders is passed over."""
    early, late = at_common_orders(*halves(0.0))
    _, variance = aligned_difference(early, late, 0.0)
    shifted = replace(late, values=late.values + 2.0 * np.sqrt(variance))
    noise = replace(early, orders=None)
    difference, _ = aligned_difference(early, shifted, 0.0)
    statistic = 2.0 * np.sum(np.abs(difference) ** 2 / aligned_difference(early, shifted, 0.0)[1])
    p = chi2.sf(statistic, 2 * early.values.size - 1)
    assert drift_p_value([noise, early], [noise, shifted], 0.0) == (
        pytest.approx(2 * p),
        early.label,
    )
    assert drift_p_value([early], [late], 0.0)[0] == 1.0
    assert drift_p_value([noise], [noise], 0.0) == (1.0, "")


def test_evidence_of_many_tries_is_worth_less():
    """Markov's inequality with a union bound; a probability is 1 at most, and never overflows."""
    assert evidence_p_value(5.0, 10) == pytest.approx(10 * np.exp(-5.0))
    assert evidence_p_value(0.0, 10) == 1.0
    assert evidence_p_value(1e4, 1) == pytest.approx(np.exp(-700.0))
