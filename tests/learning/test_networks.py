"""The architectures against the paper's tables, and against published parameter counts."""

from __future__ import annotations

import sys

import pytest
import torch
import yaml
from torch import nn

from paths import ROOT
from rippletwin.learning.architectures import ARCHITECTURES
from rippletwin.learning.networks import build

TIME = {name for name, a in ARCHITECTURES.items() if a.domain == "time"}


def shapes(network, x):
    """(layer type, output shape) of every layer of ``features``, the pooling and the head."""
    seen = []
    layers = [*network.features, network.pool, network.head]
    hooks = [
        layer.register_forward_hook(
            lambda layer, _, y: seen.append((type(layer).__name__, tuple(y.shape[1:])))
        )
        for layer in layers
    ]
    network.eval()(x)
    for hook in hooks:
        hook.remove()
    return seen


def test_cnn1d_341_100_has_the_shapes_of_the_paper():
    """Every layer's output is the paper's table's, kernel, stride and width too. A pool comes
    before its ReLU."""
    network = build("cnn1d_341_100", channels=2)
    assert shapes(network, torch.zeros(1, 2, 3072)) == [
        ("Convolution", (64, 1, 59)),
        ("MaxPool2d", (64, 1, 30)),
        ("ReLU", (64, 1, 30)),
        ("Convolution", (64, 1, 30)),
        ("MaxPool2d", (64, 1, 30)),
        ("ReLU", (64, 1, 30)),
        ("AdaptiveAvgPool2d", (64, 1, 1)),
        ("Linear", (4,)),
    ]
    first, second = network.features[0], network.features[3]
    assert (first.kernel_size, first.stride) == ((1, 341), (1, 100))
    assert (second.kernel_size, second.stride) == ((1, 3), (1, 1))
    pools = [(pool.kernel_size, pool.stride) for pool in (network.features[1], network.features[4])]
    assert pools == [((1, 3), (1, 2)), ((1, 3), 1)]


def test_cnn2d_3_1_has_the_shapes_of_the_paper():
    """Every layer's output is the paper's table's, kernel, stride and width too. A pool comes
    before its ReLU."""
    network = build("cnn2d_3_1", channels=2)
    assert shapes(network, torch.zeros(1, 2, 256, 256)) == [
        ("Convolution", (64, 256, 256)),
        ("MaxPool2d", (64, 128, 128)),
        ("ReLU", (64, 128, 128)),
        ("Convolution", (64, 128, 128)),
        ("MaxPool2d", (64, 64, 64)),
        ("ReLU", (64, 64, 64)),
        ("AdaptiveAvgPool2d", (64, 1, 1)),
        ("Linear", (4,)),
    ]
    for convolution in (network.features[0], network.features[3]):
        assert (convolution.kernel_size, convolution.stride) == ((3, 3), (1, 1))
    for pool in (network.features[1], network.features[4]):
        assert (pool.kernel_size, pool.stride) == (2, 2)


@pytest.mark.parametrize("name", ARCHITECTURES)
def test_kernel_and_stride_are_those_of_the_name(name):
    """The key and the paper's title spell the first convolution; the layer has that shape."""
    architecture = ARCHITECTURES[name]
    first = build(name, channels=2).features[0]
    assert first.kernel_size[1] == architecture.kernel and first.stride[1] == architecture.stride
    assert f"{architecture.kernel}@{architecture.stride})" in architecture.title
    if architecture.domain == "image":
        assert first.kernel_size[0] == architecture.kernel


@pytest.mark.parametrize("channels", [1, 2])
@pytest.mark.parametrize("name", ARCHITECTURES)
def test_all_take_one_or_two_channels_and_small_images(name, channels):
    """Flow (one channel) and pressure (two) pass through every network and give four logits."""
    shape = (3, channels, 3072) if name in TIME else (3, channels, 32, 32)
    assert build(name, channels).eval()(torch.zeros(shape)).shape == (3, 4)


def test_every_network_takes_the_smallest_inputs_of_a_configuration():
    """An image leaves something behind every layer, and no cyclic padding is cut, which would move
    what a feature sees."""
    keys = yaml.safe_load((ROOT / "workflow/schemas/config.schema.yaml").read_text())["properties"]
    samples = keys["windows"]["properties"]["samples_per_revolution"]["minimum"]
    size = keys["sst"]["properties"]["size"]["minimum"]
    assert samples >= max(ARCHITECTURES[name].padding for name in TIME)
    for name in set(ARCHITECTURES) - TIME:
        build(name, 1).eval()(torch.zeros(1, 1, size, size))


@pytest.mark.parametrize(
    ("name", "published"), [("resnet18_2d", 11_689_512), ("resnet34_2d", 21_797_672)]
)
def test_residual_trunk_has_the_published_number_of_parameters(name, published):
    """Independent truth: the parameter counts of ResNet18 and 34 (He et al. 2016, as commonly
    implemented), less their first convolution with its normalisation and their 1000-class head."""
    blocks = build(name, channels=2).features[4:]
    trunk = published - 3 * 64 * 7 * 7 - 2 * 64 - 1000 * (512 + 1)
    assert sum(p.numel() for p in blocks.parameters()) == trunk


def test_time_networks_equal_a_one_dimensional_convolution():
    """A window as a one-row image gives what torch's Conv1d and MaxPool1d give with its weights."""
    torch.manual_seed(0)
    network = build("cnn1d_341_100", channels=2).eval()
    first, second = network.features[0], network.features[3]
    x = torch.randn(2, 2, 3072)
    padded = torch.cat([x[..., -1536:], x, x[..., :1536]], -1)
    y = nn.functional.conv1d(padded, first.weight[:, :, 0], first.bias, stride=100).relu()
    y = nn.functional.max_pool1d(y, 3, 2, 1)
    y = nn.functional.conv1d(y, second.weight[:, :, 0], second.bias, padding=1).relu()
    y = nn.functional.max_pool1d(y, 3, 1, 1).mean(-1)
    torch.testing.assert_close(network(x), network.head(y), rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize(("name", "shape"), [("cnn1d_3_1", (96,)), ("cnn2d_3_1", (16, 16))])
def test_a_pool_before_its_relu_changes_nothing(name, shape):
    """Logits and all gradients are those of the paper's order, ReLU before pool."""
    torch.manual_seed(0)
    network, x = build(name, channels=2), torch.randn(3, 2, *shape)
    first, pool, relu, second, last_pool, last_relu = network.features
    logits = network(x)
    logits.square().sum().backward()
    gradients = [p.grad.clone() for p in network.parameters()]
    network.features = nn.Sequential(first, relu, pool, second, last_relu, last_pool)
    network.zero_grad()
    in_order = network(x)
    in_order.square().sum().backward()
    assert torch.equal(logits, in_order)
    for one, other in zip(gradients, network.parameters(), strict=True):
        torch.testing.assert_close(one, other.grad, rtol=1e-6, atol=1e-7)


def test_cyclic_padding_sees_two_revolutions():
    """The first layer of 341@100 on one revolution is the unpadded layer on two of them: 59 steps
    of 100 in 6144 points are where the table's length comes from."""
    network = build("cnn1d_341_100", channels=2)
    first, x = network.features[0], torch.randn(1, 2, 3072)
    two = torch.cat([x, x], -1).roll(1536, -1)
    unpadded = nn.functional.conv1d(two, first.weight[:, :, 0], first.bias, stride=100)
    torch.testing.assert_close(first(x[:, :, None])[:, :, 0], unpadded, rtol=1e-4, atol=1e-5)


def test_amplitude_is_not_normalised_away():
    """Half the ripple gives other logits: nothing in a network rescales its input by itself."""
    torch.manual_seed(0)
    for name in ARCHITECTURES:
        x = torch.randn(1, 2, 3072) if name in TIME else 1 + torch.rand(1, 2, 32, 32)
        network = build(name, channels=2).eval()
        assert not torch.allclose(network(x), network(x / 2), atol=1e-5), name


def test_torchvision_stays_out():
    """torchvision does not import beside a CPU torch; nothing here may need it."""
    assert "torchvision" not in sys.modules
