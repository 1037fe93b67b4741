"""The flow sensor by its method's name, and the noise of what it estimates."""

from types import SimpleNamespace

import numpy as np
import pytest

from rippletwin.flow_sensor import pinn
from rippletwin.flow_sensor.methods import estimate_flow_by, last_gain, noise_of_flow


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


@pytest.mark.parametrize(("last", "warned"), [(0.5, True), (0.99, False)])
def test_a_training_that_still_gains_at_its_end_is_told(monkeypatch, last, warned):
    """Of a hundred steps the last ten halve the loss, or lower it by a hundredth: the log warns of
    the first only, with the gain and the remedy."""
    losses = np.concatenate([np.geomspace(1.0, 1e-4, 90), last * np.full(10, 1e-4)])
    assert last_gain(losses) == pytest.approx(1.0 - last)
    monkeypatch.setattr(pinn, "train", lambda *_: (SimpleNamespace(residual=0.01), losses))
    monkeypatch.setattr(pinn, "estimate_flow", lambda *_: None)
    said = []
    estimate_flow_by(
        "pinn", np.zeros((1, 1, 8)), 10.0, None, np.ones(1), 100.0,
        width=4, steps=100, threads=1, progress=said.append,
    )  # fmt: skip
    assert said[0].startswith("equations hold to 0.01")
    told = "flow_sensor.pinn.steps"  # the key of the configuration
    assert any("not converged" in x and "50%" in x and told in x for x in said) is warned


def test_an_unknown_method_is_an_error():
    """A misspelt method is not taken for the other one."""
    with pytest.raises(ValueError, match="spectral, pinn"):
        estimate_flow_by(
            "spectrum", np.zeros((1, 1, 8)), 10.0, None, np.ones(1), 100.0,
            width=4, steps=1, threads=1, progress=print,
        )  # fmt: skip
