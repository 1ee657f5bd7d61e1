"""PAAD's branch for the camera's picture."""

from __future__ import annotations

from torch import Tensor, nn

from model_zoo.layers.resnet18 import ResNet18

REDUCED, CHANNELS = 64, 32


class ImageBranch(nn.Module):
    """ResNet18's trunk, two convolutions and a dense layer (tianchenji/PAAD, nets/PAAD.py).

    A picture of 240 x 320 becomes 64 x 4 x 5, then 32 x 4 x 5 features.
    """

    def __init__(self, height: int, width: int, features: int = 64, trunk_width: int = 64) -> None:
        """Build it for pictures of one size.

        Args:
            height: Rows of the picture.
            width: Columns of the picture.
            features: Length of the branch's vector.
            trunk_width: Channels of the trunk's first stage.
        """
        super().__init__()
        self.resnet = ResNet18(1, trunk_width, reduction=None)
        del self.resnet.fc
        self.reduction = nn.Conv2d(8 * trunk_width, REDUCED, 3, stride=2, padding=1)
        self.convolution = nn.Sequential(nn.Conv2d(REDUCED, CHANNELS, 3, padding=1), nn.ReLU())
        pixels = -(-height // 64) * -(-width // 64)
        self.dense = nn.Sequential(nn.Flatten(), nn.Linear(CHANNELS * pixels, features), nn.ReLU())

    def freeze(self) -> None:
        """Keep the trunk's and the reduction's weights; batch statistics go on, as in PAAD."""
        self.resnet.requires_grad_(requires_grad=False)
        self.reduction.requires_grad_(requires_grad=False)

    def reduced(self, picture: Tensor) -> Tensor:
        """What the trunk and the reduction, not rectified, make of a picture: (B, 64, h, w)."""
        maps: Tensor = self.reduction(self.resnet.trunk(picture))
        return maps

    def forward(self, picture: Tensor) -> Tensor:
        """Features (B, F) of normalised pictures (B, 3, H, W)."""
        vector: Tensor = self.dense(self.convolution(self.reduced(picture)))
        return vector
