"""Convolutions of the networks against torch's own."""

from __future__ import annotations

import pytest
import torch
from torch import nn

from rippletwin.learning.convolution import SMALL_MAP, Convolution

ROWS = {  # channels, width, kernel, stride, padding, cyclic, length of the row
    "first layer of 341@100": (2, 8, 341, 100, 1536, True, 3072),
    "three taps": (5, 7, 3, 1, 1, False, 30),
    "three taps, every second": (5, 7, 3, 2, 1, False, 31),
    "shortcut": (5, 7, 1, 2, 0, False, 30),
    "long row": (2, 7, 3, 1, 1, True, SMALL_MAP + 9),
}
IMAGES = {  # channels, width, kernel, stride, padding, size
    "three by three": (5, 7, 3, 1, 1, (8, 8)),
    "every second": (5, 7, 3, 2, 1, (15, 12)),
    "even kernel, every third": (2, 7, 6, 3, 2, (17, 24)),
    "not square": (3, 4, (2, 3), (1, 2), (0, 1), (9, 6)),
    "shortcut": (5, 7, 1, 2, 0, (8, 7)),
    "large map": (5, 7, 3, 1, 1, (9, 8)),
}


def assert_alike(ours, other, x, x_other, weights):
    """Maps, and their slopes in inputs, weights and biases."""
    other.load_state_dict(weights)
    found, expected = [], []
    for layer, images, seen in ((ours, x, found), (other, x_other, expected)):
        images = images.clone().requires_grad_()
        maps = layer(images)
        maps.pow(3).sum().backward()
        seen += [maps, images.grad, *(p.grad for p in layer.parameters())]
    for one, reference in zip(found, expected, strict=True):
        torch.testing.assert_close(one.reshape(reference.shape), reference)


@pytest.mark.parametrize("bias", [True, False])
@pytest.mark.parametrize("shape", ROWS.values(), ids=ROWS)
def test_rows_are_those_of_a_one_dimensional_convolution(shape, bias):
    """Against torch's Conv1d in double precision; the slope at a cyclic row's end includes what the
    other end sees of it."""
    channels, width, kernel, stride, padding, cyclic, length = shape
    torch.manual_seed(0)
    taps = (1, kernel), (1, stride), (0, padding)
    ours = Convolution(channels, width, *taps, bias=bias, cyclic=cyclic).double()
    mode = "circular" if cyclic else "zeros"
    other = nn.Conv1d(channels, width, kernel, stride, padding, bias=bias, padding_mode=mode)
    weights = {k: v[:, :, 0] if v.ndim == 4 else v for k, v in ours.state_dict().items()}
    rows = torch.randn(3, channels, length, dtype=torch.float64)
    assert_alike(ours, other.double(), rows[:, :, None], rows, weights)


@pytest.mark.parametrize("order", [torch.contiguous_format, torch.channels_last])
@pytest.mark.parametrize("shape", IMAGES.values(), ids=IMAGES)
def test_images_are_those_of_a_two_dimensional_convolution(shape, order):
    """Against torch's Conv2d in double precision, in either order of memory."""
    *arguments, size = shape
    torch.manual_seed(0)
    ours = Convolution(*arguments).double().to(memory_format=order)
    other = nn.Conv2d(*arguments).double()
    images = torch.randn(3, arguments[0], *size, dtype=torch.float64)
    assert_alike(ours, other, images.contiguous(memory_format=order), images, ours.state_dict())


def test_under_autocast_products_are_bfloat16_and_slopes_float32():
    """The maps are those of the inputs rounded to bfloat16, to the rounding of the result; weights
    get float32 slopes."""
    torch.manual_seed(0)
    layer, x = Convolution(16, 8, 3, 1, 1), torch.randn(4, 16, 8, 8)
    with torch.autocast("cpu", torch.bfloat16):
        maps = layer(x)
    assert maps.dtype is torch.bfloat16
    numbers = (value.bfloat16().double() for value in (x, layer.weight, layer.bias))
    rounded = nn.functional.conv2d(*numbers, padding=1)
    torch.testing.assert_close(maps.double(), rounded, rtol=2**-8, atol=2e-3)
    maps.float().sum().backward()
    assert layer.weight.grad.dtype is torch.float32
    assert torch.equal(layer.bias.grad, torch.full((8,), 4.0 * 64))
