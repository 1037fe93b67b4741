"""Convolutions, as matrix products where they give small maps.

In channels-last order the inputs that an output sees lie side by side, so that a convolution is the
product of a matrix of windows and the weights. Where few outputs share many weights, that takes
less time on a processor than torch's convolution, above all backward. Larger maps are left to
torch, and so is everything on a GPU.
"""

from __future__ import annotations

import torch
from torch import nn

SMALL_MAP = 60
"""Most outputs of an image that a product gives. The networks' rows have up to 59 outputs or
thousands; their images have 4 times 4 in the last residual stage of an image of 64 pixels, where a
product is faster, and 8 times 8 or more in the others, where it is not."""


class Convolution(nn.Conv2d):
    """A convolution (n, channels, H, W) -> (n, width, rows, columns).

    cyclic  whether the ends of one-row images are joined, not padded with zeros. torch's own cyclic
            padding gives the same but leaves channels-last order, and the copy back takes half as
            long as the convolution.

    Other arguments are those of ``nn.Conv2d``.
    """

    def __init__(self, *arguments, cyclic: bool = False, **options):
        super().__init__(*arguments, **options)
        self.cyclic = cyclic

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        above, beside = map(int, self.padding)
        if self.cyclic and beside:
            x, beside = torch.cat([x[..., -beside:], x, x[..., :beside]], -1), 0
        rows, columns = (
            (size + 2 * padding - kernel) // stride + 1
            for size, padding, kernel, stride in zip(
                x.shape[2:], (above, beside), self.kernel_size, self.stride
            )
        )
        if x.device.type != "cpu" or rows * columns > SMALL_MAP:
            return nn.functional.conv2d(x, self.weight, self.bias, self.stride, (above, beside))
        if above or beside:
            x = nn.functional.pad(x, (beside, beside, above, above))
        maps = _WindowProduct.apply(x, self.weight, self.bias, self.stride)
        return maps.view(len(x), rows, columns, -1).permute(0, 3, 1, 2)


class _WindowProduct(torch.autograd.Function):
    """The maps (n rows columns, width) of images (n, channels, H, W), in the precision of
    autocast."""

    @staticmethod
    def forward(ctx, x, weight, bias, stride):
        precision = weight.dtype
        if torch.is_autocast_enabled("cpu"):
            precision = torch.get_autocast_dtype("cpu")
        images = x.to(precision).permute(0, 2, 3, 1).contiguous()  # (n, H, W, channels)
        kernel = weight.shape[2:]
        windows = _view_windows(images, kernel, stride)
        ctx.shape, windows = windows.shape, windows.reshape(-1, weight[0].numel())
        matrix = weight.to(precision).permute(0, 2, 3, 1).reshape(len(weight), -1)
        ctx.save_for_backward(windows, matrix)
        ctx.images, ctx.kernel, ctx.stride = images.shape, kernel, stride
        ctx.types = x.dtype, weight.dtype
        if bias is None:
            return windows @ matrix.T
        return torch.addmm(bias.to(precision), windows, matrix.T)

    @staticmethod
    def backward(ctx, slope):
        windows, matrix = ctx.saved_tensors
        (high, wide), (down, right), (x_type, weight_type) = ctx.kernel, ctx.stride, ctx.types
        by_x = by_weight = by_bias = None
        if ctx.needs_input_grad[0]:
            by_window = (slope @ matrix).view(ctx.shape)
            by_image = slope.new_zeros(ctx.images)
            _, rows, columns, *_ = ctx.shape
            for i in range(high):
                for j in range(wide):
                    down_to, right_to = i + down * rows, j + right * columns
                    by_image[:, i:down_to:down, j:right_to:right] += by_window[:, :, :, i, j]
            by_x = by_image.permute(0, 3, 1, 2).to(x_type)
        if ctx.needs_input_grad[1]:
            by_weight = (slope.T @ windows).to(weight_type)
            by_weight = by_weight.view(len(matrix), high, wide, -1).permute(0, 3, 1, 2)
        if ctx.needs_input_grad[2]:
            by_bias = slope.sum(0, dtype=weight_type)
        return by_x, by_weight, by_bias, None


def _view_windows(images, kernel, stride):
    """What each output sees: (n, rows, columns, high, wide, channels) of `images` (n, H, W,
    channels) in memory order."""
    count, height, width, channels = images.shape
    (high, wide), (down, right) = kernel, stride
    rows, columns = (height - high) // down + 1, (width - wide) // right + 1
    line = width * channels
    return images.as_strided(
        (count, rows, columns, high, wide, channels),
        (height * line, down * line, right * channels, line, channels, 1),
    )
