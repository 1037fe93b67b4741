"""The measures of misfit."""

import numpy as np
import pytest

from paper_rig import paper_rig
from rippletwin.calibration.likelihood import Likelihood
from rippletwin.calibration.misfit import misfit, theil
from rippletwin.twin.twin import Twin
from synthetic_recordings import point, recordings


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
    assert theil(measured, predicted) == pytest.approx(expected, rel=1e-9)
    assert misfit(Likelihood(twin, data), twin.theta).theil == pytest.approx(expected, rel=1e-9)
