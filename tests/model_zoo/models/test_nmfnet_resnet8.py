from __future__ import annotations

import pytest
import torch

from model_zoo.models.nmfnet import ResNet8, SameConv2d


@pytest.mark.parametrize(("channels", "count"), [(3, 309_984), (1, 308_384)])
def test_parameter_counts(channels: int, count: int) -> None:
    assert sum(p.numel() for p in ResNet8(channels).parameters()) == count


@pytest.mark.parametrize(
    ("picture", "features"),
    [((240, 320), (8, 10)), ((200, 200), (7, 7)), ((160, 320), (5, 10)), ((120, 160), (4, 5))],
)
def test_feature_sizes(picture: tuple[int, int], features: tuple[int, int]) -> None:
    found = ResNet8(1, 4).eval()(torch.zeros(1, 1, *picture))
    assert found.shape == (1, 16, *features)
    assert ResNet8.feature_size(*picture) == features


@pytest.mark.parametrize("kernel", [3, 5])
def test_the_odd_pixel_of_same_padding_lies_to_the_right_and_below(kernel: int) -> None:
    layer = SameConv2d(1, 1, kernel, 2)
    torch.nn.init.ones_(layer.weight)
    torch.nn.init.zeros_(layer.bias)  # type: ignore[arg-type]
    sums = layer(torch.ones(1, 1, 8, 9))[0, 0]
    missing = {3: ([3, 3, 3, 2], [2, 3, 3, 3, 2]), 5: ([4, 5, 5, 3], [3, 5, 5, 5, 3])}
    rows, columns = (torch.tensor(side, dtype=torch.float32) for side in missing[kernel])
    torch.testing.assert_close(sums, torch.outer(rows, columns))


def test_the_shortcut_takes_the_input_before_it_is_normalised() -> None:
    block = ResNet8(1).blocks[0].eval()
    torch.nn.init.zeros_(block.residual[5].weight)  # type: ignore[union-attr, index]
    torch.nn.init.zeros_(block.residual[5].bias)  # type: ignore[union-attr, index]
    features = torch.randn(2, 32, 9, 9)
    torch.testing.assert_close(block(features), block.shortcut(features))  # type: ignore[operator]
