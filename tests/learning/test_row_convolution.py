"""Convolutions of one-row images against torch's own."""

from __future__ import annotations

import pytest
import torch
from torch import nn

from rippletwin.learning.row_convolution import SHORT_ROW, RowConvolution

SHAPES = {  # channels, width, kernel, stride, padding, cyclic, length of the row
    "first layer of 341@100": (2, 8, 341, 100, 1536, True, 3072),
    "three taps": (5, 7, 3, 1, 1, False, 30),
    "three taps, every second": (5, 7, 3, 2, 1, False, 31),
    "shortcut": (5, 7, 1, 2, 0, False, 30),
    "long row": (2, 7, 3, 1, 1, True, SHORT_ROW + 9),
}


@pytest.mark.parametrize("bias", [True, False])
@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
def test_maps_and_slopes_are_those_of_a_one_dimensional_convolution(shape, bias):
    """Maps, and their slopes in rows, weights and biases, against torch's Conv1d in double
    precision; the slope at the row's end includes what the other end sees of it."""
    channels, width, kernel, stride, padding, cyclic, length = shape
    torch.manual_seed(0)
    ours = RowConvolution(channels, width, kernel, stride, padding, bias, cyclic).double()
    mode = "circular" if cyclic else "zeros"
    other = nn.Conv1d(
        channels, width, kernel, stride, padding, bias=bias, padding_mode=mode
    ).double()
    other.load_state_dict(
        {k: v[:, :, 0] if v.ndim == 4 else v for k, v in ours.state_dict().items()}
    )
    rows = torch.randn(3, channels, length, dtype=torch.float64)
    found, expected = [], []
    for layer, x, seen in ((ours, rows[:, :, None], found), (other, rows, expected)):
        x = x.clone().requires_grad_()
        maps = layer(x)
        maps.pow(3).sum().backward()
        seen += [maps, x.grad, layer.weight.grad, *([layer.bias.grad] if bias else [])]
    for one, reference in zip(found, expected, strict=True):
        torch.testing.assert_close(one.reshape(reference.shape), reference)


def test_under_autocast_products_are_bfloat16_and_slopes_float32():
    """The maps are those of the inputs rounded to bfloat16, to the rounding of the result; weights
    get float32 slopes."""
    torch.manual_seed(0)
    layer, x = RowConvolution(16, 8, 3, 1, 1), torch.randn(4, 16, 1, 40)
    with torch.autocast("cpu", torch.bfloat16):
        maps = layer(x)
    assert maps.dtype is torch.bfloat16
    rounded = nn.functional.conv2d(
        x.bfloat16().double(), layer.weight.bfloat16().double(), layer.bias.bfloat16().double(),
        padding=(0, 1),
    )  # fmt: skip
    torch.testing.assert_close(maps.double(), rounded, rtol=2**-8, atol=2e-3)
    maps.float().sum().backward()
    assert layer.weight.grad.dtype is torch.float32
    expected = layer.bias.grad - 4 * 40
    assert torch.equal(expected, torch.zeros_like(expected))
