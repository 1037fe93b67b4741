"""The descent to a mode: its end, where no prediction exists, and the errors that it leaves."""

import numpy as np
import pytest

from rippletwin.calibration.frequency_continuation import refine
from rippletwin.calibration.levenberg_marquardt import descend
from rippletwin.calibration.posterior import Posterior
from synthetic_effects import AIR, MUCH_AIR, TRUTH, VOLUME
from synthetic_observations import POINTS, make


def test_descent_ends_where_no_steady_state_is_found():
    """With so much air that no steady state is found the objective is infinite, although the last
    iterate is finite. A descent that begins there ends there, and its fit has no evidence."""
    _, observations, truth = make(np.random.default_rng(1), AIR, MUCH_AIR, points=POINTS[:1])
    posterior, theta = Posterior(truth, observations), truth.theta.copy()
    assert np.isfinite(posterior.objective(theta, posterior.predict(theta)))
    theta[truth.index["entrained_air@line.gas_fraction"]] += 3.5
    prediction = posterior.predict(theta)
    assert np.all(np.isfinite(prediction))
    assert posterior.objective(theta, prediction) == np.inf
    assert descend(posterior, theta, 3)[1] == np.inf
    assert refine(truth.with_(effects=()), AIR, observations, [theta]).evidence == -np.inf


def test_descent_refuses_steps_to_infinite_predictions(monkeypatch):
    """The prediction of a line without loss is infinite at its resonance. A step there is refused.
    A start there is given up, and a hypothesis with no other start has no evidence."""
    _, observations, truth = make(np.random.default_rng(1), (), TRUTH)
    whole = Posterior.predict
    boundary = truth.theta[0] + 0.05  # the mode lies beyond it

    def predict(self, theta):
        return whole(self, theta) * (np.nan if theta[0] < boundary else 1.0)

    monkeypatch.setattr(Posterior, "predict", predict)
    base = truth.with_(theta=np.zeros_like(truth.theta))
    assert refine(base, (), observations, [truth.theta]).evidence == -np.inf
    inside = truth.theta + 0.5 * np.eye(len(truth.theta))[0]
    fit = refine(base, (), observations, [inside])
    assert fit.twin.theta[0] >= boundary and np.isfinite(fit.evidence)


@pytest.mark.parametrize("seed, turned_deg", [(0, 30), (1, 30), (2, 10), (2, 30)])
def test_errors_at_the_end_are_the_likeliest_wherever_the_descent_began(seed, turned_deg):
    """A shaft angle that is 10 or 30 degrees of a harmonic off makes errors look large. They shrink
    with the angle, but not all the way by small steps: at the end no estimate that knows nothing of
    the way makes the data likelier by more than 0.01; small steps alone leave 180 to 27000."""
    rng = np.random.default_rng(seed)
    source = 0.3 if seed == 2 else 0.1
    _, observations, truth = make(rng, VOLUME, TRUTH, points=POINTS[:1], source=source, noise=500.0)
    posterior, theta = Posterior(truth, observations), truth.theta.copy()
    angle = truth.index["angle[point 1]"]
    theta[angle] += np.deg2rad(turned_deg / 9) / 0.01
    fixed = [k for k in range(len(theta)) if k != angle]
    theta, value = descend(posterior, theta, 20, fixed)
    prediction = posterior.predict(theta)
    assert posterior.objective(theta, prediction) == pytest.approx(value, abs=1e-6)
    fresh = Posterior(truth, observations)
    fresh.estimate_errors(prediction, theta)
    assert value < fresh.objective(theta, prediction) + 0.01
