"""Scripts of the workflow on cases that are rare: what they refuse, and what they let pass."""

import numpy as np
import pytest
import xarray as xr

from rippletwin import store
from rippletwin.errors import InputError
from rippletwin.learning.training import History
from run_script import run_script

SAMPLES = 1024


def test_a_short_recording_that_nobody_learns_from_does_not_stop_a_training(tmp_path, monkeypatch):
    """Networks of recordings learn from the first one of each state: a second slipper of two
    windows, which would be too few, is left out; the first one of two windows is refused."""
    learnt = []

    def train(network, x, y, *_):
        learnt.append(y.tolist())
        return network, History([1.0], [0.5], [0.9], 0, True, "target")

    monkeypatch.setattr("rippletwin.learning.training.train_stepwise", train)
    monkeypatch.setattr("rippletwin.learning.side_by_side.train_all", lambda made, _: made)

    def run(*recordings):
        state = np.concatenate([[name] * count for name, count in recordings])
        number = np.concatenate([[k] * count for k, (_, count) in enumerate(recordings)])
        store.save(
            xr.Dataset(
                {"signal": (("window", "channel", "time"), np.zeros((len(state), 1, SAMPLES)))},
                coords={"state": ("window", state), "recording": ("window", number)},
                attrs={"labels": [f"{name}{k}" for k, (name, _) in enumerate(recordings)]},
            ),
            tmp_path / "recorded.zarr",
        )
        run_script(
            "train",
            tmp_path,
            {"weights": tmp_path / "weights.pt", "history": tmp_path / "history.json"},
            {"dataset": "experimental", "architecture": "cnn1d_341_100"},
            {"seeds": 1, "settings": {}, "learnt_share": 0.8, "cylinder": "C1"}
            | {"gpu": False, "precision": "float32"},
            samples=[tmp_path / "recorded.zarr"],
        )

    run(("H", 5), ("S", 5), ("S", 2), ("C", 5), ("?", 1))
    assert learnt == [[0] * 4 + [1] * 4 + [2] * 4]
    with pytest.raises(InputError, match="recording S1: file: makes 2 windows"):
        run(("H", 5), ("S", 2), ("S", 5))
