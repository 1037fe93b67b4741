"""The flow sensor by its method's name, and the noise of what it estimates."""

import numpy as np
import pytest

from rippletwin.flow_sensor.methods import estimate_flow_by, noise_of_flow


def test_noise_is_that_of_healthy_recordings():
    """Three recordings with noise of 1, 2 and 9; the first two are healthy: their mean, and the
    ripple itself, which repeats, does not count. Without a healthy one, the mean of all."""
    rng = np.random.default_rng(0)
    recording = np.repeat([0, 1, 2], 200)
    ripple = 50 * np.sin(2 * np.pi * np.arange(64) / 64)
    flow = ripple + np.array([1.0, 2.0, 9.0])[recording, None] * rng.standard_normal((600, 64))
    healthy = recording < 2
    assert noise_of_flow(flow, recording, healthy) == pytest.approx([1.5], rel=0.02)
    nobody = np.zeros(600, dtype=bool)
    assert noise_of_flow(flow, recording, nobody) == pytest.approx([4.0], rel=0.02)


def test_an_unknown_method_is_an_error():
    """A misspelt method is not taken for the other one."""
    with pytest.raises(ValueError, match="spectral, pinn"):
        estimate_flow_by(
            "spectrum", np.zeros((1, 1, 8)), 10.0, None, np.ones(1), 100.0,
            width=4, steps=1, threads=1, progress=print,
        )  # fmt: skip
