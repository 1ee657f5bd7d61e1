from __future__ import annotations

import torch
from torch.nn.functional import conv2d

from model_zoo.layers.resnet18 import Cbam


def test_its_first_spatial_map_is_a_half() -> None:
    cbam = Cbam(32, 16)
    x = torch.randn(2, 32, 6, 8)
    gate = cbam._channel_gate(x)[:, :, None, None]
    torch.testing.assert_close(cbam(x), x * gate * 0.5)


def test_it_is_the_published_sum_channel_by_channel() -> None:
    torch.manual_seed(0)
    cbam = Cbam(4, 2).eval()
    torch.nn.init.constant_(cbam.spatial_norm.weight, 1.5)
    x = torch.randn(1, 4, 9, 7)
    gate = torch.sigmoid(
        sum(
            cbam.channel_mlp(torch.stack([pool(channel) for channel in x[0]]))
            for pool in (torch.mean, torch.max)
        )
    )
    scaled = x[0] * gate[:, None, None]
    pooled = torch.stack([scaled.max(0).values, scaled.mean(0)])[None]
    score = conv2d(pooled, cbam.spatial_conv.weight, padding=3) * 1.5 / (1 + 1e-5) ** 0.5
    torch.testing.assert_close(cbam(x)[0], scaled * torch.sigmoid(score[0]))


def test_narrow_maps_keep_a_hidden_unit() -> None:
    assert Cbam(8, 16)(torch.randn(2, 8, 3, 3)).shape == (2, 8, 3, 3)
