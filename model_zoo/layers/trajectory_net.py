"""The trajectory image to features: three convolutions, three poolings (GrASPE, section IV-B4)."""

from __future__ import annotations

from typing import cast

import torch
from torch import Tensor, nn
from torch.nn.functional import conv2d, pad

from graspe_data.errors import ZooError
from graspe_data.manifest import Settings

_WINDOWED = 6
"""Layers up to the map of which each place sees a window of its own."""


class TrajectoryNetSettings(Settings):
    """The sizes of a TrajNet.

    Kernels 3, 2, 2 are printed; strides, padding and one last channel are what takes 240 x 320 to
    4 x 5, the 20 features printed.

    Attributes:
        channels: Of the first two convolutions; the third has one.
        first_stride: Of the first convolution: 2, or 1 for pictures of half the size.
    """

    channels: tuple[int, int] = (8, 16)
    first_stride: int = 2


class TrajectoryNet(nn.Module):
    """Pictures (B, H, W), 1 on the trajectory, to ``outputs`` numbers each, not activated.

    Its first weights are torch's, made positive, and its first biases 0 (ours): so a line passes
    all layers, and what comes out says where it runs. Drawn with both signs, most outputs begin
    rectified away or alike for all lines, and thousands of steps do not tell left from right.
    """

    def __init__(
        self, outputs: int, size: tuple[int, int], settings: TrajectoryNetSettings
    ) -> None:
        """Make the layers for pictures of ``size`` (H, W).

        Raises:
            ZooError: Pictures of that size do not give ``outputs`` numbers.
        """
        super().__init__()
        first, second = settings.channels
        self.layers = nn.Sequential(
            nn.Conv2d(1, first, 3, stride=settings.first_stride, padding=1),
            nn.MaxPool2d(2),
            nn.ReLU(),
            nn.Conv2d(first, second, 2, stride=2),
            nn.MaxPool2d(2),
            nn.ReLU(),
            nn.Conv2d(second, 1, 2, stride=2, padding=1),
            nn.MaxPool2d(2),
            nn.Flatten(),
        )
        height, width = (_length(side, settings.first_stride) for side in size)
        if height * width != outputs:
            raise ZooError(
                f"TrajNet: trajectory images of {size[0]} x {size[1]} with first stride "
                f"{settings.first_stride} give {height} x {width} numbers, expected {outputs}; "
                f"240 x 320 with stride 2 and 120 x 160 with stride 1 give 4 x 5."
            )
        self._let_lines_pass()

    @torch.no_grad()
    def _let_lines_pass(self) -> None:
        for layer in self.layers:
            if isinstance(layer, nn.Conv2d) and layer.bias is not None:
                layer.weight.abs_()
                layer.bias.zero_()

    def forward(self, picture: Tensor) -> Tensor:
        """The numbers (B, outputs), row by row of the last map.

        In training only the windows that the line crosses are computed, a tenth of the picture; the
        result is the same.
        """
        maps = self._crossed_windows(picture) if self.training else self._all_windows(picture)
        return self.layers[_WINDOWED:](maps)  # type: ignore[no-any-return]

    def _all_windows(self, picture: Tensor) -> Tensor:
        """The map (B, second, h, w) before the last convolution.

        Channels lie last, which on a CPU takes less than half the time.
        """
        drawing = picture[:, None].to(memory_format=torch.channels_last)
        return self.layers[:_WINDOWED](drawing)  # type: ignore[no-any-return]

    def _crossed_windows(self, picture: Tensor) -> Tensor:
        """The same map: each of its places sees one window, and all empty windows look alike."""
        first = cast("nn.Conv2d", self.layers[0])
        stride = first.stride[0]
        side, step = 7 * stride + 3, 8 * stride
        windows = pad(picture, (1, 1, 1, 1)).unfold(1, side, step).unfold(2, side, step)
        crossed = windows.amax((3, 4)) > 0
        kept = windows[crossed]
        drawn = torch.cat((kept, kept.new_zeros(1, side, side)))[:, None]
        seen = conv2d(drawn, first.weight, first.bias, stride)
        features: Tensor = self.layers[1:_WINDOWED](seen).flatten(1)
        flat = crossed.flatten()
        place = torch.where(flat, flat.cumsum(0) - 1, len(kept))
        return features[place].view(*crossed.shape, -1).permute(0, 3, 1, 2)


def _length(side: int, first_stride: int) -> int:
    """The side of the last map: each formula is that of one convolution and its pooling."""
    side = ((side - 1) // first_stride + 1) // 2
    side = side // 2 // 2
    return (side // 2 + 1) // 2
