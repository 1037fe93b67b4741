"""Attention of a network on networks whose answer and whose heat are known."""

import numpy as np
import pytest
import torch

from rippletwin.learning.architectures import CLASSES
from rippletwin.learning.attention_summary import fault_attention, recording_attention
from rippletwin.learning.grad_cam import attention_map, measure_alignment
from rippletwin.learning.networks import build

S = CLASSES.index("S")


def network(evidence: float):
    """A network that calls everything S: its head's weights for S are `evidence`, and a bias."""
    torch.manual_seed(0)
    made = build("cnn1d_341_100", channels=1).eval()
    with torch.no_grad():
        made.head.weight.zero_()
        made.head.weight[S] = evidence
        made.head.bias.zero_()
        made.head.bias[S] = 1e6
    return made


@pytest.fixture
def windows():
    return np.random.default_rng(0).standard_normal((3, 1, 3072)).astype(np.float32)


def test_the_share_is_the_mean_over_inputs(windows):
    """Against `measure_alignment` of each input alone, for a region of its own in each."""
    made = network(1.0)
    region = np.zeros((3, 3072), dtype=bool)
    for k in range(3):
        region[k, 500 * k : 500 * k + 400] = True
    shares = [
        measure_alignment(attention_map(made, windows[k : k + 1], S), region[k : k + 1])[0]
        for k in range(3)
    ]
    attended, blind = fault_attention(made, {"S": windows}, {"S": region})
    assert attended == pytest.approx([np.mean(shares)]) and blind.tolist() == [0.0]


def test_a_network_without_evidence_attends_to_nothing(windows):
    """Only negative evidence for S: no share at all, every input blind, heat NaN, no warning."""
    made = network(-1.0)
    region = np.ones((3, 3072), dtype=bool)
    attended, blind = fault_attention(made, {"S": windows}, {"S": region})
    assert np.isnan(attended).all() and blind.tolist() == [1.0]
    called, share, heat = recording_attention(made, windows)
    assert called == "S" and share == 1.0 and heat.shape == (3072,) and np.isnan(heat).all()


def test_the_heat_of_a_recording_is_of_what_most_windows_are_called(windows):
    """Everything is called S: its heat has mean one over the revolution, as each window's has."""
    called, share, heat = recording_attention(network(1.0), windows)
    assert (called, share) == ("S", 1.0)
    assert heat.mean() == pytest.approx(1.0) and np.ptp(heat) > 0
