"""The trajectory image to features: three convolutions, three poolings (GrASPE, section IV-B4)."""

from __future__ import annotations

from functools import reduce
from typing import Annotated, cast

import torch
from pydantic import Field
from torch import Tensor, nn
from torch.nn.functional import conv2d, embedding_bag, pad

from graspe_data.errors import ZooError
from graspe_data.manifest import Settings
from model_zoo.bounds import Width

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

    channels: tuple[Width, Width] = (8, 16)
    first_stride: Annotated[int, Field(strict=True, ge=1, le=4)] = 2


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

        In training only what differs of the windows that the line crosses is computed; the result
        is the same, for pictures of 0 and 1.
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
        stride = self._first.stride[0]
        side, step = 7 * stride + 3, 8 * stride
        rows = pad(picture, (1, 1, 1, 1)).unfold(1, side, step)
        columns = reduce(torch.maximum, rows.unbind(3)).unfold(2, side, step)
        crossed = reduce(torch.maximum, columns.unbind(3)) > 0
        kept = rows.unfold(2, side, step)[crossed]
        features = self._features(torch.cat((kept, kept.new_zeros(1, side, side))))
        flat = crossed.flatten()
        place = torch.where(flat, flat.cumsum(0) - 1, len(kept))
        return features[place].view(*crossed.shape, -1).permute(0, 3, 1, 2)

    def _features(self, windows: Tensor) -> Tensor:
        """What the windows (N, side, side) become, (N, second).

        The four places of a window, and in each the four of the second convolution's kernel, see a
        patch of the line each. There are a few hundred patches: the convolutions are done for
        those, and the windows look up and add what each patch contributes.
        """
        second = cast("nn.Conv2d", self.layers[3])
        patches, known = _different_patches(windows, self._first.stride[0])
        seen = conv2d(patches, self._first.weight, self._first.bias, self._first.stride)
        features: Tensor = self.layers[1:3](seen).flatten(1)
        shares = torch.einsum("pc,ockl->klpo", features, second.weight).flatten(0, 2)
        kernel = known.view(-1, 2, 2, 2, 2).permute(0, 1, 3, 2, 4).reshape(-1, 4)
        row = kernel + len(patches) * torch.arange(4, device=kernel.device)
        sums = embedding_bag(row, shares, mode="sum").view(len(windows), 4, -1)
        return torch.relu(sums.amax(1) + cast("Tensor", second.bias))

    @property
    def _first(self) -> nn.Conv2d:
        return cast("nn.Conv2d", self.layers[0])


def _different_patches(windows: Tensor, stride: int) -> tuple[Tensor, Tensor]:
    """What the 4 x 4 places after the first pooling see of windows (N, side, side) of 0 and 1.

    Returns:
        The P patches that differ, float32 (P, 1, n, n); which of them each place sees, (N, 4, 4).
    """
    side, step = stride + 3, 2 * stride
    columns = windows.to(torch.int32).unfold(2, side, step).unbind(3)
    rows = reduce(torch.add, (column << i for i, column in enumerate(columns))).long()
    codes = (row << i * side for i, row in enumerate(rows.unfold(1, side, step).unbind(3)))
    known, place = torch.unique(reduce(torch.add, codes), return_inverse=True)
    bit = torch.arange(side * side, device=known.device)
    patches = (known[:, None] >> bit & 1).to(windows.dtype)
    return patches.view(-1, 1, side, side), place


def _length(side: int, first_stride: int) -> int:
    """The side of the last map: each formula is that of one convolution and its pooling."""
    side = ((side - 1) // first_stride + 1) // 2
    side = side // 2 // 2
    return (side // 2 + 1) // 2
