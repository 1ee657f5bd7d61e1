"""ResNet8: a short residual network for small pictures."""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn.functional import pad

from model_zoo.picture_input import laid_out


class ResNet8(nn.Module):
    """DroNet's trunk (uzh-rpg/rpg_public_dronet, cnn_models.py; aioz-ai/FADNet has the same).

    A 5 x 5 convolution and a pooling, then three pre-activated residual blocks that each halve the
    picture. 240 x 320 becomes 8 x 10, 200 x 200 becomes 7 x 7. The 1e-4 that DroNet puts on the
    squared 3 x 3 kernels is left to the optimiser's weight decay.
    """

    def __init__(self, channels: int, width: int = 32) -> None:
        """Build it.

        Args:
            channels: Of the picture.
            width: Of the first block; the others have twice and four times as many.
        """
        super().__init__()
        self.width = width
        self.stem = nn.Sequential(SameConv2d(channels, width, 5, 2), nn.MaxPool2d(3, 2))
        self.blocks = nn.Sequential(
            _Block(width, width), _Block(width, 2 * width), _Block(2 * width, 4 * width)
        )

    def forward(self, picture: Tensor) -> Tensor:
        """Features (B, 4 width, h, w), not yet rectified, of pictures (B, channels, H, W)."""
        features: Tensor = self.blocks(self.stem(laid_out(picture, self.width)))
        return features

    @staticmethod
    def feature_size(height: int, width: int) -> tuple[int, int]:
        """Height and width of the features of a picture."""
        return _feature_length(height), _feature_length(width)


class SameConv2d(nn.Conv2d):
    """A convolution padded as TensorFlow's ``same``: an odd pixel goes to the right and below."""

    def __init__(self, channels: int, features: int, kernel: int, stride: int = 1) -> None:
        """A square kernel, with a bias; kernels of 3 start as He et al. draw them."""
        super().__init__(channels, features, kernel, stride)
        if kernel == 3:  # noqa: PLR2004 - DroNet draws these alone so
            nn.init.kaiming_normal_(self.weight)

    def forward(self, input: Tensor) -> Tensor:  # noqa: A002 - torch's name
        """Convolve (B, C, H, W) to (B, F, ceil(H / stride), ceil(W / stride))."""
        top, bottom = self._padding(input.shape[2])
        left, right = self._padding(input.shape[3])
        return super().forward(pad(input, (left, right, top, bottom)))

    def _padding(self, length: int) -> tuple[int, int]:
        kernel, stride = self.kernel_size[0], self.stride[0]
        missing = max(0, (_halved(length, stride) - 1) * stride + kernel - length)
        return missing // 2, missing - missing // 2


class _Block(nn.Module):
    """Normalise, rectify, convolve, twice; the shortcut takes the input as it came."""

    def __init__(self, before: int, after: int) -> None:
        super().__init__()
        self.residual = nn.Sequential(
            nn.BatchNorm2d(before),
            nn.ReLU(),
            SameConv2d(before, after, 3, 2),
            nn.BatchNorm2d(after),
            nn.ReLU(),
            SameConv2d(after, after, 3),
        )
        self.shortcut = nn.Conv2d(before, after, 1, 2)

    def forward(self, features: Tensor) -> Tensor:
        return torch.add(self.shortcut(features), self.residual(features))


def _halved(length: int, stride: int) -> int:
    return -(-length // stride)


def _feature_length(length: int) -> int:
    pooled = (_halved(length, 2) - 3) // 2 + 1
    return _halved(pooled, 8)
