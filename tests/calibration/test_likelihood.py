"""The error model of calibration against its definition."""

from dataclasses import replace

import numpy as np
import pytest

from paper_rig import paper_rig
from rippletwin.calibration.likelihood import Likelihood
from rippletwin.case.model import Load
from rippletwin.twin.twin import Twin
from synthetic_recordings import point, recordings


@pytest.mark.parametrize("source", ["known", "nominal", "free"])
def test_gradient_is_that_of_the_sum_of_squares(source):
    """The whitening depends on the prediction. Residual and Jacobian nevertheless give the change
    of half the sum of squares by difference quotients in every parameter."""
    rig = replace(paper_rig(), load=Load("closed"))
    points = [replace(point(rig, highest_hz=1500.0), source=source)]
    truth, data = recordings(rig, points, seed=3)
    model = Likelihood(Twin(rig, data), data, evenness=0.5)
    model.model_error, model.source_sd = 0.02, 0.04
    theta = truth + 0.05
    r, jacobian = model.linearise(theta, model.predict(theta))

    def half_square(theta):
        return 0.5 * np.sum(model.residual(theta, model.predict(theta)) ** 2)

    step = 1e-5 * np.eye(len(theta))
    quotients = [(half_square(theta + d) - half_square(theta - d)) / 2e-5 for d in step]
    size = np.max(np.abs(quotients))
    np.testing.assert_allclose(jacobian.T @ r, quotients, rtol=1e-3, atol=1e-5 * size)


def test_pressures_and_an_input_impedance_are_fitted_together():
    """Of a periodic recording and an input impedance each is compared with its own prediction, in
    the order of the observations, and both enter the residual."""
    rig = paper_rig(segments=1, sensors=2)
    periodic = point(rig, highest_hz=1500.0)
    frequency = np.linspace(100.0, 900.0, 7)
    impedance = replace(
        periodic,
        kind="input_impedance",
        label="z",
        orders=None,
        frequency_hz=frequency,
        values=np.full((1, 7), 2e9 + 1e9j),
        covariance=np.full((7, 1, 1), 1e12 + 0j),
        sensors=(),
        source="known",
        flow_ripple=None,
        speed_hz=None,
    )
    _, (recorded,) = recordings(rig, [periodic], seed=1)
    data = [impedance, recorded]
    twin = Twin(rig, data)
    model = Likelihood(twin, data)
    prediction = model.predict(twin.theta)
    reflections, pressures = model.by_observation(prediction)
    assert reflections.measured.shape == reflections.predicted.shape == (1, 7)
    assert np.array_equal(pressures.measured, recorded.values)
    np.testing.assert_allclose(pressures.predicted, twin.predict([recorded])[0], rtol=1e-9)
    assert model.count == 2 * (7 + recorded.values.size)
    r, jacobian = model.linearise(twin.theta, prediction)
    assert jacobian.shape == (len(r), len(twin.theta))
    assert len(r) == model.count + np.sum(model.prior)


@pytest.mark.parametrize("source", ["known", "nominal"])
def test_whitened_residuals_are_the_gaussian_density(source):
    """Sum of squares and log determinant equal those of the covariance written out as a matrix."""
    rig = paper_rig()
    points = [replace(point(rig, highest_hz=900.0), source=source)]
    _, data = recordings(rig, points, seed=3, sd=3e3)
    rng = np.random.default_rng(0)
    root = rng.standard_normal((3, 3)) + 1j * rng.standard_normal((3, 3))
    covariance = np.tile(1e7 * root @ root.conj().T, (len(points[0].orders), 1, 1))
    data = [replace(data[0], covariance=covariance)]
    likelihood = Likelihood(Twin(rig, data), data)
    likelihood.model_error, likelihood.source_sd = 0.03, 0.04
    theta = 0.3 * np.ones(len(likelihood.twin.parameters))
    prediction = likelihood.predict(theta)[0]
    sigma = 0.04 if source == "nominal" else 0.0
    expected = 0.5 * np.sum(theta[likelihood.prior] ** 2)
    for f in range(prediction.shape[1]):
        v, h = data[0].values[:, f], prediction[:, f]
        matrix = covariance[f] + 0.03**2 * np.mean(np.abs(v) ** 2) * np.eye(3)
        matrix = matrix + sigma**2 * np.outer(h, h.conj())
        e = v - h
        expected += (e.conj() @ np.linalg.solve(matrix, e)).real + np.linalg.slogdet(matrix)[1]
    objective = likelihood.objective(theta, [prediction])
    assert objective == pytest.approx(expected, rel=1e-10)


def test_a_free_source_hides_any_factor_common_to_all_sensors():
    """With the source free the residuals do not change when every frequency's values are
    multiplied by a complex number of its own (of modulus one, which leaves the model error alone).
    """
    rig = replace(paper_rig(), load=Load("closed"))
    points = [replace(point(rig), source="free")]
    _, data = recordings(rig, points, seed=2)
    turn = np.exp(1j * np.random.default_rng(1).uniform(0, 6, data[0].values.shape[1]))
    turned = [replace(data[0], values=data[0].values * turn)]
    theta = np.zeros(len(Twin(rig, data).parameters))
    models = [Likelihood(Twin(rig, d), d) for d in (data, turned)]
    costs = [model.objective(theta, model.predict(theta)) for model in models]
    assert costs[0] == pytest.approx(costs[1], rel=1e-10)
