"""Fitting hypotheses: derivatives, recovery, evidence, and what a search makes of them."""

import numpy as np
import pytest

from rippletwin.calibration.frequency_continuation import fit_hypothesis, refine
from rippletwin.calibration.levenberg_marquardt import descend
from rippletwin.calibration.multistart import MAX_FOLLOWED, select_by_score_test
from rippletwin.calibration.posterior import MIN_MODEL_ERROR, SIZE_SD, Posterior
from rippletwin.calibration.whitening import source_scale
from rippletwin.explanation.fit_jobs import scan_starts, transfer_theta, weak_effect_starts
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.twin import Twin
from synthetic_observations import POINTS, make

VOLUME = ((EFFECTS["line_volume"], Place("position")),)
HOSE = ((EFFECTS["viscoelastic_wall"], Place("segment 2", 1)),)
GAIN = ((EFFECTS["sensor_gain"], Place("sensor p2", 1)),)
AIR = ((EFFECTS["entrained_air"], Place("line")),)
LEAK = ((EFFECTS["leak"], Place("position")),)
TRUTH = {
    "line_volume@position.position": 4.4,
    "line_volume@position.volume": 6e-5,
    "viscoelastic_wall@segment 2.compliance_ratio": 0.2,
    "viscoelastic_wall@segment 2.retardation_time": 3e-4,
    "sensor_gain@sensor p2.gain_error": 0.08,
    "entrained_air@line.gas_fraction": 3e-3,
    "leak@position.position": 5.0,
    "leak@position.conductance": 4e-11,
}


@pytest.mark.parametrize("hypothesis", [(), VOLUME, HOSE, GAIN, AIR])
def test_derivatives_equal_difference_quotients(hypothesis):
    """All columns in one sweep agree with central differences of the whole nonlinear model to the
    2 % that holding the orifice's remainder costs."""
    rng = np.random.default_rng(1)
    _, observations, truth = make(rng, hypothesis, TRUTH)
    posterior = Posterior(truth, observations)
    theta = truth.theta + 0.1 * rng.normal(size=len(truth.theta))
    columns = posterior.forward.derivatives(theta)
    forward = ForwardModel(truth, observations)
    for k, column in enumerate(columns):
        step = 1e-5 * np.eye(len(theta))[k]
        up, down = (np.concatenate(forward(theta + side * step), 1) for side in (1, -1))
        quotient = (up - down) / 2e-5
        assert np.linalg.norm(column - quotient) < 0.02 * np.linalg.norm(quotient) + 1e-6


def test_followed_derivatives_know_what_the_line_stores():
    """Of 0.8 % of air, holding what it stores costs every wave speed's column more than a per cent;
    followed, all columns agree with central differences of the nonlinear model to half of one."""
    values = TRUTH | {"entrained_air@line.gas_fraction": 8e-3}
    _, observations, truth = make(np.random.default_rng(1), AIR, values)
    posterior, theta = Posterior(truth, observations), truth.theta
    held = posterior.forward.derivatives(theta)
    posterior.use_full_jacobian(theta)
    columns = posterior.forward.derivatives(theta)
    forward = ForwardModel(truth, observations)
    for k, p in enumerate(truth.parameters):
        step = 1e-4 * np.eye(len(theta))[k]
        up, down = (np.concatenate(forward(theta + side * step), 1) for side in (1, -1))
        quotient = (up - down) / 2e-4
        size = np.linalg.norm(quotient)
        assert np.linalg.norm(columns[k] - quotient) < 0.005 * size
        if p.name.startswith("wave_speed"):
            assert np.linalg.norm(held[k] - quotient) > 0.01 * size


def test_no_fit_leads_where_no_steady_state_is_found():
    """Air so strong that substitution finds no steady state is infinitely unlikely, however well
    what was found last may fit; a descent that sets out from there ends there."""
    values = TRUTH | {"entrained_air@line.gas_fraction": 8e-3}
    _, observations, truth = make(np.random.default_rng(1), AIR, values)
    posterior, theta = Posterior(truth, observations), truth.theta.copy()
    assert np.isfinite(posterior.objective(theta, posterior.predict(theta)))
    theta[truth.index["entrained_air@line.gas_fraction"]] += 3.5
    prediction = posterior.predict(theta)
    assert np.all(np.isfinite(prediction))
    assert posterior.objective(theta, prediction) == np.inf
    assert descend(posterior, theta, 3)[1] == np.inf
    assert refine(truth.with_(effects=()), AIR, observations, [theta]).evidence == -np.inf


def test_a_fit_from_one_start_ends_at_the_very_mode():
    """With 0.8 % of air in the line no step of half a standard deviation, in twenty directions of
    the covariance, leads to anything likelier; with derivatives that hold what is stored the
    descent ends where some lead 1.6 of log posterior up."""
    values = TRUTH | {"entrained_air@line.gas_fraction": 8e-3}
    rng = np.random.default_rng(3)
    bench, observations, truth = make(rng, AIR, values)
    fit = refine(Twin(bench, observations), AIR, observations, [truth.theta])
    posterior, theta = Posterior(fit.twin, observations), fit.twin.theta
    here = posterior.predict(theta)
    posterior.estimate_errors(here, theta)
    root = np.linalg.cholesky(fit.covariance)
    for draw in rng.normal(size=(20, len(theta))):
        step = 0.5 * root @ draw / np.linalg.norm(draw)
        for moved in (theta - step, theta + step):
            value = posterior.objective(moved, posterior.predict(moved))
            assert value > posterior.objective(theta, here) - 0.25


@pytest.mark.parametrize("place", [1.3, 4.4, 7.7])
def test_starts_at_the_effect_promise_most(place):
    """Of starts all along the line, from a good fit without the effect, the score test keeps one
    within an eighth of the shortest wave of a volume of 0.4 cm3, whose place it is not told."""
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
    found = [twin.values(theta)["line_volume@position.position"] for theta in kept]
    assert len(kept) == MAX_FOLLOWED
    assert min(abs(x - place) for x in found) < 1000 / 4000 / 8


def test_no_descent_enters_where_the_prediction_is_infinite(monkeypatch):
    """A line without loss has no finite answer at its resonance: a step there is refused, a start
    there is given up, and a hypothesis with no other start has no evidence."""
    _, observations, truth = make(np.random.default_rng(1), (), TRUTH)
    whole = Posterior.predict
    ends = truth.theta[0] + 0.05  # short of the mode

    def predict(self, theta):
        return whole(self, theta) * (np.nan if theta[0] < ends else 1.0)

    monkeypatch.setattr(Posterior, "predict", predict)
    base = truth.with_(theta=np.zeros_like(truth.theta))
    outside = truth.theta
    assert refine(base, (), observations, [outside]).evidence == -np.inf
    inside = truth.theta + 0.5 * np.eye(len(truth.theta))[0]
    found = refine(base, (), observations, [inside])
    assert found.twin.theta[0] >= ends and np.isfinite(found.evidence)


def test_whitened_residual_of_the_truth_has_unit_variance():
    """At the true parameters, with noise alone, the residuals have mean square 1 (chi-square)."""
    _, observations, truth = make(np.random.default_rng(2), source=0.0, noise=4e5)
    posterior = Posterior(truth, observations)
    posterior.model_error, posterior.source_sd = 0.0, 0.0
    r = posterior.whitened(posterior.predict(truth.theta))[0]
    assert abs(np.mean(np.abs(r) ** 2) - 1) < 5 / np.sqrt(r.size)


def test_blind_to_the_source_ignores_its_amplitude():
    """Scaling the source at every frequency by anything leaves the source-free residual alone."""
    rng = np.random.default_rng(3)
    _, observations, truth = make(rng)
    posterior = Posterior(truth, observations, source_free=True)
    prediction = posterior.predict(truth.theta)
    other = prediction * np.exp(rng.normal(size=prediction.shape[1]) * 1j) * 1.7
    np.testing.assert_allclose(
        np.abs(posterior.whitened(prediction)[0]) ** 2,
        np.abs(posterior.whitened(other)[0]) ** 2,
        atol=1e-6,
    )


@pytest.mark.parametrize("hypothesis", [VOLUME, HOSE, LEAK], ids=["volume", "hose", "leak"])
def test_continuation_finds_the_truth_from_nominal(hypothesis):
    """From nominal values that are off as stated, the fit with the true effect ends as good as one
    started at the truth, with the effect's parameters within four standard deviations."""
    bench, observations, truth = make(np.random.default_rng(11), hypothesis, TRUTH)
    base = Twin(bench, observations)
    found = fit_hypothesis(base, hypothesis, observations, scan_starts(bench, hypothesis))
    known = refine(base, hypothesis, observations, [truth.theta])
    assert found.model_error < 2 * MIN_MODEL_ERROR
    assert found.evidence > known.evidence - 1.0
    for p in truth.parameters:
        if "@" in p.name:
            k = truth.index[p.name]
            assert abs(found.twin.theta[k] - truth.theta[k]) < 4 * found.sd[k]


def test_log_likelihood_is_that_of_the_whole_covariance_matrix():
    """Squares and log determinant of the whitened residual are those of one dense Gaussian with
    noise, model error and the source's error (rough, smooth, of size) over all sensors,
    frequencies and recordings."""
    rng = np.random.default_rng(12)
    _, observations, truth = make(rng, points=POINTS[:2])
    posterior = Posterior(truth, observations, 2000.0)
    posterior.model_error, posterior.source_sd, posterior.smooth_sd = 0.02, 0.03, 0.1
    prediction = posterior.predict(truth.theta + 0.05 * rng.normal(size=len(truth.theta)))
    f, recording = posterior.forward.frequency_hz, posterior.forward.recording
    kernel = (1 + np.outer(f, f) / 1e6) * np.exp(-0.5 * np.subtract.outer(f, f) ** 2 / 1e6)
    kernel += 1.0
    kernel *= 0.5 + 0.5 * (recording[:, None] == recording)
    source = 0.03**2 * np.eye(len(f)) + 0.1**2 * kernel
    scale = [source_scale(posterior.forward.source.flow[part]) for part in posterior.forward.slices]
    h = (prediction * np.concatenate(scale)).ravel()
    sensors = len(prediction)
    dense = np.outer(h, h.conj()) * np.kron(np.ones((sensors, sensors)), source)
    dense += SIZE_SD**2 * np.outer(prediction.ravel(), prediction.ravel().conj())
    noise = np.concatenate([o.covariance[:, 0, 0].real for o in posterior.observations])
    dense += np.diag(np.tile(noise + 0.02**2 * posterior.power, sensors))
    e = (posterior.values - prediction).ravel()
    r, log_determinant = posterior.whitened(prediction)
    square = np.sum(np.abs(r) ** 2)
    assert square == pytest.approx((e.conj() @ np.linalg.solve(dense, e)).real, rel=2e-3)
    # The kernel is cut at 0.1 % of its largest eigenvalue; evidence is judged in whole units.
    assert log_determinant == pytest.approx(np.linalg.slogdet(dense)[1], abs=0.7)


@pytest.mark.parametrize("source_free", [False, True])
def test_the_gradient_is_that_of_the_objective(source_free):
    """Residuals are judged by the prediction itself: the change of the objective in any direction
    of the prediction, by difference quotients, is what residual and Jacobian say it is."""
    _, observations, truth = make(np.random.default_rng(8))
    posterior = Posterior(truth, observations, None, source_free)
    theta = truth.theta + 0.05
    h = posterior.predict(theta)
    posterior.estimate_errors(h, theta)
    rng = np.random.default_rng(9)
    ways = 0.1 * np.abs(h).mean() * (rng.normal(size=(5, *h.shape, 2)) @ np.array([1, 1j]))
    r, jacobian = posterior.linearise(theta, h, ways)
    told = (jacobian.T @ r)[len(theta) :]
    step = 1e-5
    made = [
        (posterior.objective(theta, h + step * d) - posterior.objective(theta, h - step * d))
        / (2 * step)
        for d in ways
    ]
    np.testing.assert_allclose(told, made, rtol=1e-5, atol=1e-4 * np.max(np.abs(made)))


def test_a_smaller_prediction_is_no_likelier():
    """The size of a ripple being uncertain by SIZE, data that are the prediction cost least as they
    are, and 1 % more or less cost about alike: only the size's own error pays for it."""
    _, observations, truth = make(np.random.default_rng(8), source=0.0, noise=1.0)
    posterior = Posterior(truth, observations)
    h = posterior.predict(truth.theta)
    posterior.estimate_errors(h, truth.theta)
    costs = [posterior.objective(truth.theta, (1 + x) * h) for x in (-0.01, 0.0, 0.01)]
    assert costs[1] < min(costs[0], costs[2])
    assert abs(costs[0] - costs[2]) < 0.1
    assert max(costs) - costs[1] < 1.5 * (0.01 / SIZE_SD) ** 2
