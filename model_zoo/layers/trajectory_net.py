"""The trajectory image to features: three convolutions, three poolings (GrASPE, section IV-B4)."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from graspe_data.errors import ZooError
from graspe_data.manifest import Settings


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
    """Pictures (B, H, W), 1 on the trajectory, to ``outputs`` numbers each, not activated."""

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

    def forward(self, picture: Tensor) -> Tensor:
        """The numbers (B, outputs), row by row of the last map.

        Maxima are taken before they are rectified, which is the same on a quarter of the pixels,
        and channels lie last, which on a CPU takes less than half the time.
        """
        drawing = picture[:, None].to(memory_format=torch.channels_last)
        return self.layers(drawing)  # type: ignore[no-any-return]


def _length(side: int, first_stride: int) -> int:
    """The side of the last map: each formula is that of one convolution and its pooling."""
    side = ((side - 1) // first_stride + 1) // 2
    side = side // 2 // 2
    return (side // 2 + 1) // 2
