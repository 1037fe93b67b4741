"""Grad-CAM against captum, its geometry against impulses, alignment against cases by hand."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from torch import nn

from rippletwin.learning.architectures import ARCHITECTURES
from rippletwin.learning.grad_cam import (
    attention_density,
    attention_map,
    fault_region,
    feature_positions,
    grad_cam,
    measure_alignment,
)
from rippletwin.learning.networks import build


def network_and_input(name, n=3):
    torch.manual_seed(0)
    network = build(name, channels=2).eval()
    shape = (n, 2, 3072) if ARCHITECTURES[name].domain == "time" else (n, 2, 48, 48)
    x = np.random.default_rng(0).standard_normal(shape).astype(np.float32)
    return network, x + network.architecture.silence


@pytest.mark.parametrize("name", ARCHITECTURES)
def test_agrees_with_captum(name):
    """Other implementation: captum's LayerGradCam by back-propagation, to 1e-5 of its largest
    value, for every architecture, each sample with a class of its own."""
    captum = pytest.importorskip("captum.attr")
    network, x = network_and_input(name)
    target = np.array([0, 3, 1])
    theirs = captum.LayerGradCam(network, network.features).attribute(
        torch.as_tensor(x), torch.as_tensor(target), relu_attributions=True
    )
    theirs = theirs[:, 0].detach().numpy()
    np.testing.assert_allclose(grad_cam(network, x, target), theirs, atol=1e-5 * theirs.max())


def circular_centre(weight):
    """Centre (samples) of a non-negative weight (M,) around the revolution."""
    angle = 2 * np.pi * np.arange(len(weight)) / len(weight)
    return np.angle((weight * np.exp(1j * angle)).sum()) * len(weight) / (2 * np.pi)


def make_positive(network):
    """Weights all equal and positive: what goes in comes out at the same place."""
    for layer in network.features.modules():
        if isinstance(layer, nn.Conv2d):
            nn.init.constant_(layer.weight, 1e-2)
            if layer.bias is not None:
                nn.init.zeros_(layer.bias)
    nn.init.constant_(network.head.weight, 1.0)
    return network


@pytest.mark.parametrize("name", ["cnn1d_341_100", "cnn1d_150_50", "cnn1d_3_1", "resnet18_1d"])
def test_features_sit_where_their_receptive_field_is_centred(name):
    """Against back-propagation: with maxima made means and all weights positive, the gradient of a
    feature towards the input is centred on the stated position, cyclically. (The residual
    network's fields are wider than a revolution: it gets a window long enough to hold one.)"""
    network = make_positive(network_and_input(name)[0])
    points = 3072 * (64 if name == "resnet18_1d" else 1)
    x = torch.ones(1, 2, points, requires_grad=True)
    count = network.feature_maps(x).shape[-1]
    positions = feature_positions(network, count, axis=1)
    for index, layer in enumerate(network.features):
        if isinstance(layer, nn.MaxPool2d):
            network.features[index] = nn.AvgPool2d(layer.kernel_size, layer.stride, layer.padding)
    maps = network.feature_maps(x)
    feature = count // 2
    (gradient,) = torch.autograd.grad(maps[0, :, 0, feature].sum(), x)
    off = circular_centre(gradient[0].sum(0).numpy()) - positions[feature]
    assert abs((off + points / 2) % points - points / 2) < (5 if points > 3072 else 0.1)


@pytest.mark.parametrize("name", ["cnn1d_341_100", "cnn1d_150_50", "cnn1d_3_1"])
def test_attention_finds_the_pulse(name):
    """A pulse in a silent revolution, wherever it is: attention is centred within half a
    kernel of it (a plain stretch of the coarse map over the window would miss by up to half a
    revolution where the padding is cyclic)."""
    network = make_positive(network_and_input(name)[0])
    for at in (400, 1500, 2600):
        x = np.zeros((1, 2, 3072), dtype=np.float32)
        x[..., at - 8 : at + 8] = 1
        heat = attention_map(network, x, 0)[0]
        assert heat.shape == (3072,) and heat.min() >= 0
        assert abs((circular_centre(heat) - at + 1536) % 3072 - 1536) <= 171


def test_image_attention_finds_the_bright_spot():
    """The same in an image, in both directions."""
    network = make_positive(network_and_input("cnn2d_3_1")[0])
    x = np.ones((1, 2, 48, 48), dtype=np.float32)
    x[..., 9:12, 33:36] += 1
    heat = attention_map(network, x, 0)[0]
    row, column = np.unravel_index(heat.argmax(), heat.shape)
    assert heat.shape == (48, 48) and abs(row - 10) <= 2 and abs(column - 34) <= 2


def test_attention_turns_with_the_shaft():
    """The 3@1 network is cyclic but for its second padding: turning the revolution turns what it
    attends to."""
    network, x = network_and_input("cnn1d_3_1", n=1)
    heat, turned = (
        attention_map(network, x, 1)[0],
        attention_map(network, np.roll(x, 600, -1), 1)[0],
    )
    np.testing.assert_allclose(np.roll(heat, 600)[610:-10], turned[610:-10], atol=1e-6)


def test_fault_region_is_the_smallest_that_holds_the_energy():
    """By hand: squared differences 9, 4, 1, 0 (of 14); half is in the first alone, 0.8 in two,
    0.95 by three."""
    healthy, faulty = np.zeros((1, 1, 4)), np.array([[[1.0, 3.0, 0.0, -2.0]]])
    for energy, expected in ((0.5, [1]), (0.8, [1, 3]), (0.95, [0, 1, 3])):
        region = fault_region(healthy, faulty, energy)
        assert np.flatnonzero(region[0]).tolist() == expected
    with pytest.raises(ValueError, match="equals"):
        fault_region(healthy, healthy)


def test_channels_add_up_in_the_region():
    """Two sensors' differences add as energies: 1 + 1 at one angle outweighs 1.2 at another."""
    faulty = np.array([[[1.0, 1.2, 0.0], [1.0, 0.0, 0.0]]])
    assert np.flatnonzero(fault_region(np.zeros((1, 2, 3)), faulty, 0.5)[0]).tolist() == [0]


def test_alignment_by_hand_and_at_chance():
    """All attention inside gives 1, none 0, even attention the region's own share; no attention
    gives NaN."""
    region = np.array([[True, False, False, False]] * 4)
    heat = np.array([[1.0, 0, 0, 0], [0, 2, 0, 1], [3, 3, 3, 3], [0, 0, 0, 0]])
    attended, share = measure_alignment(heat, region)
    np.testing.assert_array_equal(attended, [1, 0, 0.25, np.nan])
    np.testing.assert_array_equal(share, [0.25] * 4)


def test_region_of_an_image_is_a_frequency():
    """By hand: the fault lights up the middle row at two times and the last at one; half the
    difference is in the middle row, whenever it comes, and attention there counts at any time."""
    faulty = np.zeros((1, 1, 3, 4))
    faulty[0, 0, 1, 1:3] = faulty[0, 0, 2, 0] = 1
    region = fault_region(np.zeros_like(faulty), faulty)
    np.testing.assert_array_equal(region, [[False, True, False]])
    heat = np.array([[[0, 0, 0, 1.0], [3, 0, 0, 0], [0, 0, 0, 0]]])
    attended, share = measure_alignment(heat, region)
    np.testing.assert_allclose([attended[0], share[0]], [0.75, 1 / 3])


def test_density_has_mean_one_or_is_nothing():
    """Whatever the scale of the logits, the mean over an input is one; without attention NaN."""
    heat = attention_density(np.array([[1.0, 3.0], [100.0, 300.0], [0.0, 0.0]]))
    np.testing.assert_array_equal(heat, [[0.5, 1.5], [0.5, 1.5], [np.nan, np.nan]])
