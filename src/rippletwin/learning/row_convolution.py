"""Convolutions of one-row images, as matrix products where they give a short row.

In channels-last order the inputs that an output sees lie side by side, so that a convolution is the
product of a matrix of windows and the weights. Where few outputs share many weights, it takes a
third less time on a processor than torch's convolution. Long rows are convolved by torch, and so is
everything on a GPU.
"""

from __future__ import annotations

import torch
from torch import nn

SHORT_ROW = 256
"""Most outputs of a row that a product gives. The rows of the networks here have up to 59 outputs,
where a product is faster, or thousands, where it is slower."""


class RowConvolution(nn.Conv2d):
    """A convolution (n, channels, 1, M) -> (n, width, 1, columns) of one-row images.

    cyclic  whether the ends of the row are joined, or padded with zeros. torch's own cyclic padding
            gives the same but leaves channels-last order, and the copy back takes half as long as
            the convolution.
    """

    def __init__(
        self,
        channels: int,
        width: int,
        kernel: int,
        stride: int = 1,
        padding: int = 0,
        bias: bool = True,
        cyclic: bool = False,
    ):
        super().__init__(channels, width, (1, kernel), (1, stride), (0, padding), bias=bias)
        self.cyclic = cyclic

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        ends = int(self.padding[1])
        if ends and self.cyclic:
            x = torch.cat([x[..., -ends:], x, x[..., :ends]], -1)
        elif ends:
            x = nn.functional.pad(x, (ends, ends))
        (_, kernel), (_, stride) = self.kernel_size, self.stride
        columns = (x.shape[-1] - kernel) // stride + 1
        if x.device.type == "cpu" and columns <= SHORT_ROW:
            maps = _RowProduct.apply(x, self.weight, self.bias, stride)
            return maps.view(len(x), 1, columns, -1).permute(0, 3, 1, 2)
        return nn.functional.conv2d(x, self.weight, self.bias, self.stride)


class _RowProduct(torch.autograd.Function):
    """The maps (n columns, width) of rows (n, channels, 1, M), in the precision of autocast."""

    @staticmethod
    def forward(ctx, x, weight, bias, stride):
        precision = weight.dtype
        if torch.is_autocast_enabled("cpu"):
            precision = torch.get_autocast_dtype("cpu")
        width, channels, _, kernel = weight.shape
        rows = x.to(precision).permute(0, 2, 3, 1).contiguous()  # (n, 1, M, channels)
        count, _, length, _ = rows.shape
        columns, seen = (length - kernel) // stride + 1, kernel * channels
        windows = rows.as_strided(
            (count, columns, seen), (length * channels, stride * channels, 1)
        ).reshape(-1, seen)
        matrix = weight.to(precision).permute(0, 2, 3, 1).reshape(width, seen)
        ctx.save_for_backward(windows, matrix)
        ctx.shape, ctx.stride, ctx.types = x.shape, stride, (x.dtype, weight.dtype)
        if bias is None:
            return windows @ matrix.T
        return torch.addmm(bias.to(precision), windows, matrix.T)

    @staticmethod
    def backward(ctx, slope):
        windows, matrix = ctx.saved_tensors
        count, channels, _, length = ctx.shape
        kernel, columns = matrix.shape[1] // channels, len(slope) // count
        x_type, weight_type = ctx.types
        by_x = by_weight = by_bias = None
        if ctx.needs_input_grad[0]:
            by_window = (slope @ matrix).view(count, columns, kernel, channels)
            by_x = slope.new_zeros(count, length, channels)
            for place in range(kernel):
                stop = place + ctx.stride * (columns - 1) + 1
                by_x[:, place : stop : ctx.stride] += by_window[:, :, place]
            by_x = by_x.view(count, 1, length, channels).permute(0, 3, 1, 2).to(x_type)
        if ctx.needs_input_grad[1]:
            by_weight = (slope.T @ windows).to(weight_type)
            by_weight = by_weight.view(-1, 1, kernel, channels).permute(0, 3, 1, 2)
        if ctx.needs_input_grad[2]:
            by_bias = slope.sum(0, dtype=weight_type)
        return by_x, by_weight, by_bias, None
