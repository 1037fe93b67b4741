"""Recorded and simulated images side by side: pairs of windows, and similarities by hand."""

import numpy as np
import pytest

from rippletwin.learning.image_comparison import (
    RECORDED,
    compare_images,
    recorded_pairs,
    two_revolutions,
)
from rippletwin.learning.synchrosqueezing import SstSettings

POINTS, SPEED_HZ = 1024, 1000 / 60
RATE = POINTS * SPEED_HZ
SETTINGS = SstSettings(size=32, voices=8)
ANGLE = 2 * np.pi * np.arange(POINTS) / POINTS


def revolution(order: int, amplitude: float = 1.0) -> np.ndarray:
    return amplitude * np.sin(order * ANGLE)[None]


def test_pairs_carry_the_recordings_name():
    """Five windows of H make two pairs, of which one is asked for; C2 is found as C, the cylinder
    fault of unknown severity; nobody recorded S."""
    windows = np.arange(7.0)[:, None, None] * np.ones((1, 1, 4))
    state = np.array(["H"] * 5 + ["C"] * 2)
    recording = np.array([0] * 5 + [1] * 2)
    pairs = recorded_pairs(windows, state, recording, ["H", "S", "C2"], count=1)
    assert {key: name for key, (name, _) in pairs.items()} == {"H": "H", "C2": "C"}
    assert pairs["H"][1].tolist() == [[[0, 0, 0, 0, 1, 1, 1, 1]]]
    assert pairs["C2"][1].tolist() == [[[5, 5, 5, 5, 6, 6, 6, 6]]]


def test_no_pair_joins_two_recordings():
    """Two recordings of H with three windows each: the third of the first has no partner. A state
    whose recordings have one window each has no pair."""
    windows = np.arange(8.0)[:, None, None] * np.ones((1, 1, 2))
    state, recording = np.array(["H"] * 6 + ["S"] * 2), np.array([0, 0, 0, 1, 1, 1, 2, 3])
    pairs = recorded_pairs(windows, state, recording, ["H", "S"], count=8)
    assert list(pairs) == ["H"]
    assert pairs["H"][1].tolist() == [[[0, 0, 1, 1]], [[3, 3, 4, 4]]]


def test_two_revolutions_repeat_without_their_mean():
    """A revolution 1, 2, 3, 6 of mean three, twice."""
    assert two_revolutions(np.array([[1.0, 2, 3, 6]])).tolist() == [[[-2, -1, 0, 3] * 2]]


def test_the_same_signal_is_alike_and_another_is_not():
    """A simulation equal to the recording has similarity one; half of it has amplitude near a half
    (an image is exponential, so not exactly); another frequency has similarity zero."""
    recorded = {"H": np.concatenate([two_revolutions(revolution(9))] * 3)}
    simulated = {
        "same": {"H": two_revolutions(revolution(9))},
        "half": {"H": two_revolutions(revolution(9, 0.5))},
        "other": {"H": two_revolutions(revolution(45))},
    }
    table = compare_images(recorded, simulated, RATE, SETTINGS).set_index("source")
    assert table.loc["same", "similarity"] == pytest.approx(1, abs=1e-5)
    assert table.loc["same", "amplitude"] == pytest.approx(1, abs=1e-5)
    assert table.loc["half", "similarity"] > 0.95 and 0.3 < table.loc["half", "amplitude"] < 0.5
    assert table.loc["other", "similarity"] < 0.05
    assert table.windows.to_dict() == {RECORDED: 2, "same": 3, "half": 3, "other": 3}


def test_a_single_recorded_window_is_not_compared_with_itself():
    """There would be nothing to compare it with."""
    recorded = {"H": two_revolutions(revolution(9))}
    table = compare_images(recorded, {"same": recorded}, RATE, SETTINGS)
    assert table.source.tolist() == ["same"]
