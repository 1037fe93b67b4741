"""One optimiser, one continuation and one alignment serve both error models."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from paper_rig import paper_rig
from rippletwin.calibration.calibrate import calibrate
from rippletwin.calibration.frequency_continuation import fit_hypothesis, refine
from rippletwin.calibration.levenberg_marquardt import descend
from rippletwin.calibration.likelihood import Likelihood
from rippletwin.calibration.posterior import Posterior
from rippletwin.calibration.shaft_angles import align_shaft_angles, fit_shaft_angles
from rippletwin.case.model import Load
from rippletwin.twin.twin import Twin
from synthetic_recordings import point, recordings

ERROR_MODELS = pytest.mark.parametrize("error_model", [Likelihood, Posterior])


class LinearForward(SimpleNamespace):
    """A forward model h0 + A theta of one observation: h0 (S, F), A (P, S, F)."""

    solved, has_nonlinear_compliance = True, False

    def __call__(self, theta):
        return [self.offset + np.tensordot(theta, self.slopes, 1)]

    def derivatives(self, theta):
        return self.slopes

    def linear_load(self, theta):
        return None


@ERROR_MODELS
def test_optimum_of_a_linear_model_is_that_of_the_normal_equations(error_model):
    """The source is known and the model linear. Minus the log posterior then is quadratic, and the
    descent ends at (J^T J + I)^-1 J^T r, solved directly from the noise and the model error."""
    rig, rng = paper_rig(segments=1, sensors=2), np.random.default_rng(0)
    observation = replace(point(rig, highest_hz=1500.0), kind="spectrum", source="known")
    shape = observation.values.shape
    twin = Twin(rig)
    count = len(twin.parameters)
    values, offset, *slopes = rng.normal(size=(2 + count, *shape, 2)) @ np.array([1.0, 1j])
    model = error_model(twin, [replace(observation, values=values)])
    model.forward = LinearForward(
        offset=offset, slopes=np.array(slopes), slices=[slice(0, shape[1])]
    )
    theta, value = descend(model, np.zeros(count), 20, errors=False, converged=1e-12)
    # E[e e^H] is 1 (noise) + 0.1^2 |v|^2, half of it in the real and half in the imaginary part.
    variance = 0.5 * (1.0 + model.model_error**2 * np.mean(np.abs(values) ** 2, axis=0))
    sd = np.sqrt(np.broadcast_to(variance, shape)).ravel()
    parts = [x.reshape(-1, sd.size) / sd for x in (np.array(slopes), values - offset)]
    a, b = (np.concatenate([x.real, x.imag], axis=1) for x in parts)
    expected = np.linalg.solve(a @ a.T + np.eye(count), a @ b[0])
    np.testing.assert_allclose(theta, expected, atol=1e-8)
    square = 0.5 * np.sum((b[0] - expected @ a) ** 2) + 0.5 * np.sum(expected**2)
    others = [model.objective(t, model.predict(t)) - value for t in (0.0 * theta, 1.1 * theta)]
    squares = [
        0.5 * np.sum((b[0] - t @ a) ** 2) + 0.5 * np.sum(t**2) - square
        for t in (0.0 * theta, 1.1 * theta)
    ]
    assert others == pytest.approx(squares, rel=1e-9)


@pytest.fixture(scope="module")
def noisy_line():
    """A line without reflections and with a known source, and noise far above any model error."""
    rig = replace(paper_rig(segments=2, sensors=2), load=Load("anechoic"))
    points = [replace(point(rig, highest_hz=1500.0), source="known")]
    truth, data = recordings(rig, points, seed=4, sd=3e3)
    return Twin(rig, data), data, truth


def test_calibrate_and_refine_agree_where_their_error_models_coincide(noisy_line):
    """With a known source and noise that dominates the model error both error models are that of
    the noise. Calibration and both fits of explaining end at the same parameters, to a seventh of
    a standard deviation (a descent ends where a step gains 0.01), and with the same deviations."""
    twin, data, truth = noisy_line
    calibration = calibrate(twin, data)
    fits = [fit_hypothesis(twin, (), data), refine(twin, (), data, [truth])]
    angle, turn = twin.index["angle[a]"], 2 * np.pi / 9 / 0.01  # piston orders see no more
    for fit in fits:
        apart = fit.twin.theta - calibration.twin.theta
        apart[angle] = (apart[angle] + turn / 2) % turn - turn / 2
        assert np.max(np.abs(apart) / calibration.sd) < 1 / 7
        np.testing.assert_allclose(fit.sd, calibration.sd, rtol=0.1)


@ERROR_MODELS
def test_shaft_angles_are_found_anywhere_on_the_turn(error_model):
    """From an angle of zero the grid finds the true one to half its spacing. Newton's steps between
    its points and the descent that follows are ten times nearer. All other parameters stay."""
    rig = paper_rig(segments=1, sensors=2)
    truth, data = recordings(rig, [point(rig, highest_hz=1500.0)], seed=4)
    twin = Twin(rig, data)
    index, orders = twin.index["angle[a]"], data[0].orders
    prior = twin.parameters[index].prior
    start = truth.copy()
    start[index] = 0.0
    model = error_model(twin, data)

    def error(theta):
        apart = prior.value(theta[index]) - prior.value(truth[index])
        return abs(np.angle(np.exp(1j * apart * orders[0]))) / orders[0]

    spacing = 2 * np.pi / (16 * orders[-1])
    between = align_shaft_angles(model, start, between=True)[1]
    fitted = fit_shaft_angles(model, start)
    assert error(align_shaft_angles(model, start)[1]) < 0.5 * spacing
    assert error(between) < 0.05 * spacing
    assert error(fitted) < 0.05 * spacing
    assert np.array_equal(np.delete(fitted, index), np.delete(truth, index))
