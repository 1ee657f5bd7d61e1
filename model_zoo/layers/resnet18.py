"""ResNet18 with convolutional block attention; parameters are named as in torchvision."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from model_zoo.layers.picture_input import laid_out

BLOCKS_PER_STAGE = 2
SPATIAL_KERNEL = 7


class ResNet18(nn.Module):
    """Pictures (B, 3, H, W) to ``outputs`` numbers each (He et al., CVPR 2016, table 1).

    With ``width`` 64 the state dict of torchvision's ``resnet18`` loads with ``strict=False``: only
    the attention's tensors, and ``fc`` where ``outputs`` is not 1000, are then missing.
    """

    def __init__(self, outputs: int, width: int = 64, reduction: int | None = 16) -> None:
        """Make a trunk and its last layer.

        Args:
            outputs: Numbers a picture, not activated.
            width: Channels of the first stage; each later one has twice its predecessor's.
            reduction: Of the attention's MLP; None leaves the attention out.
        """
        super().__init__()
        self.conv1 = nn.Conv2d(3, width, 7, stride=2, padding=3, bias=False)
        self.bn1 = nn.BatchNorm2d(width)
        self.relu = nn.ReLU(inplace=True)
        self.maxpool = nn.MaxPool2d(3, stride=2, padding=1)
        self.layer1 = _stage(width, width, 1, reduction)
        self.layer2 = _stage(width, 2 * width, 2, reduction)
        self.layer3 = _stage(2 * width, 4 * width, 2, reduction)
        self.layer4 = _stage(4 * width, 8 * width, 2, reduction)
        self.avgpool = nn.AdaptiveAvgPool2d(1)
        self.fc = nn.Linear(8 * width, outputs)
        self.apply(_initialise)

    def trunk(self, x: Tensor) -> Tensor:
        """The last feature map (B, 8 width, H / 32, W / 32)."""
        x = laid_out(x, self.conv1.out_channels)
        x = self.maxpool(self.relu(self.bn1(self.conv1(x))))
        return self.layer4(self.layer3(self.layer2(self.layer1(x))))  # type: ignore[no-any-return]

    def forward(self, x: Tensor) -> Tensor:
        """The outputs (B, outputs)."""
        return self.fc(torch.flatten(self.avgpool(self.trunk(x)), 1))  # type: ignore[no-any-return]


class _BasicBlock(nn.Module):
    """Two 3x3 convolutions, attention, and what came in added."""

    def __init__(self, inputs: int, outputs: int, stride: int, reduction: int | None) -> None:
        super().__init__()
        self.conv1 = nn.Conv2d(inputs, outputs, 3, stride=stride, padding=1, bias=False)
        self.bn1 = nn.BatchNorm2d(outputs)
        self.conv2 = nn.Conv2d(outputs, outputs, 3, padding=1, bias=False)
        self.bn2 = nn.BatchNorm2d(outputs)
        self.relu = nn.ReLU(inplace=True)
        self.cbam = nn.Identity() if reduction is None else Cbam(outputs, reduction)
        self.downsample: nn.Module = nn.Identity()
        if stride != 1 or inputs != outputs:
            self.downsample = nn.Sequential(
                nn.Conv2d(inputs, outputs, 1, stride=stride, bias=False), nn.BatchNorm2d(outputs)
            )

    def forward(self, x: Tensor) -> Tensor:
        inner = self.bn2(self.conv2(self.relu(self.bn1(self.conv1(x)))))
        return self.relu(self.cbam(inner) + self.downsample(x))  # type: ignore[no-any-return]


class Cbam(nn.Module):
    """Scale a feature map (B, C, H, W) by channel gates, then by spatial gates.

    As in the authors' MODELS/cbam.py: one MLP C -> C / reduction -> C serves both pooled vectors;
    the spatial gate's batch normalisation starts with weight 0, so that its first map is 0.5.
    """

    def __init__(self, channels: int, reduction: int) -> None:
        """Make the gates of a map of ``channels``."""
        super().__init__()
        hidden = max(1, channels // reduction)
        self.channel_mlp = nn.Sequential(
            nn.Linear(channels, hidden), nn.ReLU(), nn.Linear(hidden, channels)
        )
        self.spatial_conv = nn.Conv2d(2, 1, SPATIAL_KERNEL, padding=SPATIAL_KERNEL // 2, bias=False)
        self.spatial_norm = nn.BatchNorm2d(1, momentum=0.01)
        nn.init.kaiming_normal_(self.spatial_conv.weight, mode="fan_out", nonlinearity="relu")
        nn.init.zeros_(self.spatial_norm.weight)

    def forward(self, x: Tensor) -> Tensor:
        """The gated map, of the same shape."""
        scaled = x * self._channel_gate(x)[:, :, None, None]
        return scaled * self._spatial_gate(scaled)

    def _channel_gate(self, x: Tensor) -> Tensor:
        pooled = torch.stack([x.mean((2, 3)), x.amax((2, 3))], dim=1)
        return torch.sigmoid(self.channel_mlp(pooled).sum(1))

    def _spatial_gate(self, x: Tensor) -> Tensor:
        pooled = torch.cat([x.amax(1, keepdim=True), x.mean(1, keepdim=True)], dim=1)
        return torch.sigmoid(self.spatial_norm(self.spatial_conv(pooled)))


def _stage(inputs: int, outputs: int, stride: int, reduction: int | None) -> nn.Sequential:
    first = _BasicBlock(inputs, outputs, stride, reduction)
    rest = [_BasicBlock(outputs, outputs, 1, reduction) for _ in range(BLOCKS_PER_STAGE - 1)]
    return nn.Sequential(first, *rest)


def _initialise(module: nn.Module) -> None:
    """Kaiming's normal weights for every convolution, as torchvision and CBAM have them."""
    if isinstance(module, nn.Conv2d):
        nn.init.kaiming_normal_(module.weight, mode="fan_out", nonlinearity="relu")
