"""The descent to a mode where no prediction exists."""

import numpy as np

from rippletwin.calibration.frequency_continuation import refine
from rippletwin.calibration.levenberg_marquardt import descend
from rippletwin.calibration.posterior import Posterior
from synthetic_effects import AIR, MUCH_AIR, TRUTH
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
