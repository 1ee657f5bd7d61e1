"""Convolutional block attention (Woo et al., ECCV 2018): channels first, then places."""

from __future__ import annotations

import torch
from torch import Tensor, nn

SPATIAL_KERNEL = 7


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
