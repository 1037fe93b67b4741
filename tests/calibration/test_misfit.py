"""The measures of misfit."""

from dataclasses import replace

import numpy as np
import pytest

from paper_rig import paper_rig
from rippletwin.calibration.likelihood import Likelihood
from rippletwin.calibration.misfit import measure_misfit, theil_coefficient
from rippletwin.calibration.pareto import sensor_misfits
from rippletwin.twin.twin import Twin
from synthetic_recordings import point, recordings


def test_impedances_count_beside_pressures():
    """A reflection coefficient 40 % off beside pressures 10 % off: either is a quantity of its own,
    though pressures are a million times larger in their unit. The Pareto form has an objective of
    each sensor and one of the impedance."""
    rig = paper_rig()
    _, (pressures,) = recordings(rig, [point(rig)], seed=4)
    impedance = replace(
        pressures,
        kind="input_impedance",
        label="z",
        source="known",
        orders=None,
        speed_hz=None,
        flow_ripple=None,
        sensors=(),
        values=np.ones((1, len(pressures.orders)), complex),
        covariance=1e-3 * pressures.covariance[:, :1, :1],
    )
    both = [pressures, impedance]
    twin = Twin(rig, both, guessed_load=False)
    model = Likelihood(twin, both)
    predicted = model.by_observation(model.predict(twin.theta))
    made, reflection = (part.predicted / share for part, share in zip(predicted, (0.9, 0.6)))
    measured = (1.0 + reflection) / (1.0 - reflection)
    off = [replace(pressures, values=made), replace(impedance, values=measured, normalised=True)]
    model = Likelihood(twin, off)
    found = measure_misfit(model, twin.theta)
    by_sensor = dict.fromkeys([s.name for s in rig.sensors], 0.1) | {"reflection": 0.4}
    assert found.relative_by_sensor == pytest.approx(by_sensor)
    assert found.relative == pytest.approx(np.sqrt((0.1**2 + 0.4**2) / 2))
    assert sensor_misfits(model, twin.theta) == pytest.approx([0.01, 0.01, 0.01, 0.16])


def test_theil_from_harmonics_is_theil_from_the_time_signals():
    """Theil's U of the complex harmonics equals root-mean-square of the difference over the sum of
    the root-mean-squares of the signals that they make (Parseval).
    """
    rig = paper_rig()
    _, data = recordings(rig, [point(rig)], seed=4)
    twin = Twin(rig, data)
    measured, predicted = data[0].values, twin.predict(data)[0]
    angle = 2 * np.pi * np.arange(4096) / 4096
    turn = np.exp(1j * np.outer(data[0].orders, angle))
    x, y = (measured @ turn).real, (predicted @ turn).real
    expected = np.sqrt(np.mean((x - y) ** 2)) / (np.sqrt(np.mean(x**2)) + np.sqrt(np.mean(y**2)))
    assert theil_coefficient(measured, predicted) == pytest.approx(expected, rel=1e-9)
    assert measure_misfit(Likelihood(twin, data), twin.theta).theil == pytest.approx(
        expected, rel=1e-9
    )


def test_an_unknown_source_is_no_misfit():
    """Readings that the line makes of any flow, different at each frequency, leave nothing at any
    sensor: a free source has its most likely amplitude. A reading that one sensor has alone is
    left."""
    rig = paper_rig()
    _, data = recordings(rig, [point(rig)], seed=4)
    free = [replace(o, source="free") for o in data]
    twin = Twin(rig, free)
    flow = np.random.default_rng(0).normal(size=(2, len(data[0].orders)))
    response = twin.predict(free)[0]
    free = [replace(free[0], values=1e-3 * (flow[0] + 1j * flow[1]) * response)]
    likelihood = Likelihood(twin, free)
    assert np.max(sensor_misfits(likelihood, twin.theta)) < 1e-20
    assert measure_misfit(likelihood, twin.theta).relative < 1e-10
    free[0].values[0] *= 1.5
    assert sensor_misfits(Likelihood(twin, free), twin.theta)[0] > 1e-3
