"""The evidence of a state against brute force, and a diagnosis at the ends of its range."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import logsumexp

import leaking_pump
from rippletwin.case.model import Case
from rippletwin.diagnosis import evidence
from rippletwin.diagnosis.diagnose import check_twin, recalibrate_twin
from rippletwin.diagnosis.diagnosed_numbers import gather
from rippletwin.diagnosis.diagnoser import Diagnoser
from rippletwin.diagnosis.doubts import find_doubts
from rippletwin.diagnosis.evidence import (
    CHANGES,
    SCATTERS,
    ErrorPrior,
    _at_best_pitch,
    _with_area,
    piston_index,
    weigh_states,
)
from rippletwin.diagnosis.faults.library import FAULTS
from rippletwin.diagnosis.hypothesis import Errors, Hypothesis
from rippletwin.diagnosis.pump_calibration import PRIOR_SD, _numbers
from rippletwin.diagnosis.pump_flow import ORDERS, load_pressure_of
from rippletwin.diagnosis.screening import Screen
from rippletwin.errors import InputError
from rippletwin.pump.faults import Slipper
from rippletwin.pump.geometry import Geometry
from rippletwin.twin.twin import Twin

SLIPPER = FAULTS["slipper"]


@pytest.fixture(scope="module")
def recordings():
    """A healthy one and one with a slipper's leak of 1e-7 m2."""
    rng = np.random.default_rng(0)
    anchor = leaking_pump.record("anchor", turn=0.3, rng=rng)
    return anchor, leaking_pump.record("slipper", Slipper(1e-7, 2), 2.1, rng)


def twin_of(anchor):
    return Twin(leaking_pump.rig(), [anchor])


def test_a_leak_that_another_one_leaves_a_single_area_has_evidence(recordings):
    """A user's fault whose smallest leak is large: beside it the other leak's prior ends where it
    begins. The pair has a finite evidence on a healthy recording, and the state is healthy."""
    anchor, _ = recordings
    again = leaking_pump.record("again", turn=1.0, rng=np.random.default_rng(5))
    large = replace(FAULTS["cylinder"], name="large", smallest=0.1)
    found = Diagnoser(twin_of(anchor), [SLIPPER, large])(again, [anchor])
    assert found.state == "healthy" and "slipper+large" in found.probabilities
    model = found.model
    areas = model.flows["large"].areas
    assert np.diff(model.area_ends(SLIPPER, [areas[0]])) > 0.0
    corner = areas[0] * model.usual_error
    low, high = model.area_ends(large, [corner])
    assert 0.0 < high - low < 1e-5


def test_two_areas_share_one_prior(recordings, monkeypatch):
    """The mean of a likelihood that is sharp about two areas, over all pairs that can be together,
    against the sum over a fine grid of pairs; for areas amid the prior, and near its end, where
    one area leaves the other little room."""
    anchor, leaking = recordings
    pair = SLIPPER, FAULTS["cylinder"]
    model = Diagnoser(twin_of(anchor), pair).make_model(leaking, anchor)
    areas = [np.log(model.flows[fault.name].areas) for fault in pair]
    for share in (0.5, 0.02):
        middle = np.array([x[0] + share * (x[-1] - x[0]) + 0.3 for x in areas])

        def likelihood(_, hypothesis, middle=middle, **_errors):
            return -0.5 * float(np.sum(((np.log(hypothesis.areas) - middle) / 0.1) ** 2))

        monkeypatch.setattr(evidence, "_over_changes", likelihood)
        mode = Hypothesis(pair, tuple(np.exp(middle)), (0, 0), 0.0, np.zeros(3))
        found, _ = evidence._over_areas(model, mode, Errors(0.005, 1.0), ErrorPrior())
        one, other = (np.linspace(x[0], x[-1], 1501) for x in areas)
        allowed = np.abs(one[:, None] - other) <= -np.log(model.usual_error)
        squares = (one[:, None] - middle[0]) ** 2 + (other - middle[1]) ** 2
        mean = np.mean(np.exp(-0.5 * squares[allowed] / 0.1**2))
        assert found == pytest.approx(np.log(mean), abs=0.05)


def test_the_evidence_is_the_mean_likelihood_over_areas_and_errors(recordings):
    """Of a slipper's leak: against the sum over a fine grid of areas and over all errors at once,
    with the shaft angle and the drift of the mode, to 0.2."""
    anchor, leaking = recordings
    model = Diagnoser(twin_of(anchor), [SLIPPER]).make_model(leaking, anchor)
    prior = ErrorPrior()
    (found,) = weigh_states(model, [(SLIPPER,)], prior)
    model.linearise_line(found.mode)
    low, high = model.area_ends(SLIPPER)
    grid = [Errors(s, c) for s in SCATTERS for c in CHANGES]
    middle = np.log(found.mode.areas[0])
    areas = np.arange(middle - 1.0, min(middle + 1.0, high), 0.04)  # elsewhere there is nothing
    each = [
        logsumexp(
            prior.log_weights().ravel() + model.log_likelihoods(_with_area(found.mode, 0, a), grid)
        )
        for a in areas
    ]
    over_areas = logsumexp(each) + np.log(0.04 / (high - low))
    again, _ = _at_best_pitch(
        model, Screen(model).screen_one(SLIPPER), Errors(prior.scatter, prior.change)
    )
    scores = np.array([c.score for c in again])
    places = logsumexp(scores - scores.max()) - 2.0 * np.log(model.pistons)
    assert found.log_evidence == pytest.approx(over_areas + places, abs=0.2)


@pytest.mark.parametrize(
    ("end", "words"), [("largest", "larger than"), ("smallest", "smaller than")]
)
def test_a_leak_beyond_what_is_tried_is_doubted(recordings, end, words):
    """A fault whose prior ends short of the true leak, an eighth of a piston's flow."""
    anchor, leaking = recordings
    fault = replace(SLIPPER, **{end: 0.115 if end == "largest" else 0.135})
    found = Diagnoser(twin_of(anchor), [fault])(leaking, [anchor])
    assert [words in text for text in find_doubts(found)] == [True]


def test_faults_that_cannot_be_together_are_tried_alone(recordings):
    """Where the priors of two leaks are too far apart the state of both has no probability."""
    anchor, leaking = recordings
    small = replace(SLIPPER, largest=0.01)
    large = replace(FAULTS["cylinder"], smallest=1.0)
    found = Diagnoser(twin_of(anchor), [small, large])(leaking, [anchor])
    assert set(found.probabilities) == {"healthy", "slipper", "cylinder"}


def test_more_orders_than_the_pump_s_are_left_out(recordings):
    """Of a slow shaft, which has more orders below the highest frequency than simulations keep."""
    anchor, _ = recordings
    orders = np.arange(1, ORDERS + 101)
    rng = np.random.default_rng(1)
    slow = replace(
        anchor,
        orders=orders,
        frequency_hz=orders * 5.0,
        speed_hz=5.0,
        values=rng.normal(size=(2, len(orders))) + 0j,
        covariance=np.tile(np.eye(2, dtype=complex), (len(orders), 1, 1)),
    )
    model = Diagnoser(twin_of(anchor), [SLIPPER]).make_model(slow, slow)
    assert model.orders[-1] == ORDERS
    assert model.leak_change(SLIPPER, 1e-7, 0).shape == (ORDERS,)


def test_readings_have_the_names_of_the_case_s_sensors(recordings):
    """A twin of two sensors and a case with the second alone."""
    anchor, leaking = (
        replace(
            o,
            values=o.values[1:],
            covariance=o.covariance[:, 1:, 1:],
            mean=o.mean[1:],
            sensors=o.sensors[1:],
        )
        for o in recordings
    )
    found = gather(Diagnoser(twin_of(recordings[0]), [SLIPPER])(leaking, [anchor]))
    assert found.sensors == ["p2"] and len(found.measured) == 1


def test_a_twin_stays_where_nothing_healthy_is_left(recordings):
    """Where all healthy recordings are to be diagnosed, none is left to fit the twin to."""
    twin = twin_of(recordings[0])
    assert recalibrate_twin(twin, [], None).twin is twin


def test_a_twin_of_another_pump_is_refused(recordings, tmp_path):
    """Of seven pistons for a case with nine; the message names both."""
    rig, twin = leaking_pump.rig(), twin_of(recordings[0])
    other = replace(rig, pump={**rig.pump, "pistons": 7})
    with pytest.raises(InputError, match=r"pump\.pistons.*7, but the twin has 9"):
        check_twin(Case(tmp_path, other, ()), twin)


def test_a_recording_without_pressure_over_its_load_is_refused(recordings):
    """Sensors without their mean, and no load pressure: nothing would drive a leak."""
    anchor = replace(recordings[0], load_pressure=None, mean=np.zeros(2))
    with pytest.raises(InputError, match="load_pressure"):
        load_pressure_of(twin_of(recordings[0]), anchor)


def test_a_piston_is_one_of_the_pump_s(recordings):
    """Also at shaft angles that are whole pitches but for rounding."""
    anchor, leaking = recordings
    model = Diagnoser(twin_of(anchor), ()).make_model(leaking, anchor)
    for pitch in range(-40, 40):
        for off in (-1e-16, 0.0, 1e-16):
            turn = 2 * np.pi * pitch / model.pistons - model.anchor.angle + off
            assert piston_index(model, 0, turn) in range(model.pistons)


@pytest.mark.parametrize("overlap", [-25.0, 60.0])
def test_a_fitted_pump_can_be_built(overlap):
    """Four standard deviations from a data sheet whose ports overlap much, or are open together."""
    pump = {**leaking_pump.SHEET, "port_overlap_deg": overlap}
    for end in (-4.0, 4.0):
        Geometry.from_dict({**pump, **_numbers(pump, np.full(len(PRIOR_SD) + 2, end))})
