"""The derivatives of the forward model against difference quotients."""

from dataclasses import replace

import numpy as np
import pytest

from rippletwin.case.model import Load
from rippletwin.twin.forward_jacobian import DifferentiableForward
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.twin import Twin
from synthetic_effects import AIR, GAIN, HOSE, MUCH_AIR, PASSAGE, TRUTH, VOLUME
from synthetic_observations import make


def difference_quotients(twin, observations, theta, step):
    """Central differences of the nonlinear model, (P, S, F)."""
    forward = ForwardModel(twin, observations)
    slopes = []
    for unit in np.eye(len(theta)):
        up, down = (np.concatenate(forward(theta + side * step * unit), 1) for side in (1, -1))
        slopes.append((up - down) / (2 * step))
    return np.array(slopes)


@pytest.mark.parametrize("hypothesis", [(), VOLUME, HOSE, GAIN, AIR, PASSAGE])
def test_derivatives_equal_difference_quotients(hypothesis):
    """All columns of one sweep agree with central differences of the nonlinear model to 2 %, which
    is what freezing the nonlinear remainder of the orifice costs."""
    rng = np.random.default_rng(1)
    _, observations, truth = make(rng, hypothesis, TRUTH)
    theta = truth.theta + 0.1 * rng.normal(size=len(truth.theta))
    columns = DifferentiableForward(truth, observations).derivatives(theta)
    for column, quotient in zip(columns, difference_quotients(truth, observations, theta, 1e-5)):
        assert np.linalg.norm(column - quotient) < 0.02 * np.linalg.norm(quotient) + 1e-6


def test_full_jacobian_includes_the_nonlinear_compliance():
    """With 0.8 % of air, freezing the nonlinear compliance makes every wave speed's column wrong by
    more than 1 %. The full Jacobian agrees with central differences to 0.5 % in all columns."""
    _, observations, truth = make(np.random.default_rng(1), AIR, MUCH_AIR)
    forward, theta = DifferentiableForward(truth, observations), truth.theta
    frozen = forward.derivatives(theta)
    forward.use_full_jacobian(theta)
    columns = forward.derivatives(theta)
    quotients = difference_quotients(truth, observations, theta, 1e-4)
    for p, column, approximate, quotient in zip(truth.parameters, columns, frozen, quotients):
        size = np.linalg.norm(quotient)
        assert np.linalg.norm(column - quotient) < 0.005 * size
        if p.name.startswith("wave_speed"):
            assert np.linalg.norm(approximate - quotient) > 0.01 * size


@pytest.mark.parametrize("hypothesis", [VOLUME, AIR])
def test_a_frozen_compliance_leaves_a_linear_one_and_the_orifice_exact(hypothesis):
    """With a frozen compliance a line without a nonlinear one is predicted as the nonlinear model
    does to 1e-12, the orifice's harmonics above those observed included: a descent ends at the mode
    of the posterior that is judged. With air the frozen outflows are another line's."""
    rng = np.random.default_rng(5)
    _, observations, truth = make(rng, hypothesis, TRUTH)
    forward = DifferentiableForward(truth, observations)
    forward(truth.theta)
    forward.freeze_compliance = True
    theta = truth.theta + 0.1 * rng.normal(size=len(truth.theta))
    exact = np.concatenate(ForwardModel(truth, observations)(theta), 1)
    difference = np.concatenate(forward(theta), 1) - exact
    assert (np.linalg.norm(difference) < 1e-12 * np.linalg.norm(exact)) == (hypothesis is VOLUME)


def test_readings_with_a_linear_load_are_those_of_a_small_ripple():
    """With a linear orifice the readings are the source's flow times the response to a unit flow,
    whatever was solved before at other values."""
    rng = np.random.default_rng(7)
    _, observations, truth = make(rng, VOLUME, TRUTH)
    forward = DifferentiableForward(truth, observations)
    theta = truth.theta + 0.1 * rng.normal(size=len(truth.theta))
    response = np.concatenate(ForwardModel(truth, observations).unit_response(theta), 1)
    linear = response * forward.source.at(theta)[0]
    full = np.concatenate(forward(theta), 1)
    forward.network(truth.theta)
    assert np.linalg.norm(forward.linear_load(theta) - linear) < 1e-10 * np.linalg.norm(linear)
    assert np.linalg.norm(full - linear) > 1e-4 * np.linalg.norm(linear)


@pytest.mark.parametrize("load, tolerance", [(Load("closed"), 1e-9), (None, 0.03)])
def test_lines_side_by_side_read_what_each_reads_alone(load, tolerance):
    """Twenty lines of other wave speeds, solved at once, against one at a time: the same with a
    linear load; with an orifice to 3 %, for its remainder is that of the first line."""
    rng = np.random.default_rng(3)
    _, observations, truth = make(rng, VOLUME, TRUTH)
    if load is not None:
        truth = Twin(replace(truth.rig, load=load), observations, effects=truth.effects)
    thetas = np.tile(0.1 * rng.normal(size=len(truth.theta)), (20, 1))
    speeds = [k for k, p in enumerate(truth.parameters) if p.name.startswith("wave_speed")]
    thetas[:, speeds] = rng.normal(size=(20, len(speeds)))
    forward = DifferentiableForward(truth, observations)
    together = forward.predict_side_by_side(thetas)
    for n, theta in enumerate(thetas):
        for alone, found in zip(ForwardModel(truth, observations)(theta), together):
            assert np.linalg.norm(found[n] - alone) < tolerance * np.linalg.norm(alone)
