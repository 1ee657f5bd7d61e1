from __future__ import annotations

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import nn

from graspe_data.errors import ZooError
from model_zoo.layers.trajectory_net import TrajectoryNet, TrajectoryNetSettings, _length


@pytest.mark.parametrize(("size", "stride"), [((240, 320), 2), ((120, 160), 1)])
def test_both_sizes_give_the_printed_features(size: tuple[int, int], stride: int) -> None:
    network = TrajectoryNet(20, size, TrajectoryNetSettings(first_stride=stride))
    kernels = [layer.kernel_size for layer in network.layers if isinstance(layer, nn.Conv2d)]
    assert kernels == [(3, 3), (2, 2), (2, 2)]
    assert network(torch.zeros(2, *size)).shape == (2, 20)


@settings(max_examples=40, deadline=None)
@given(st.integers(60, 400), st.sampled_from([1, 2, 3]))
def test_the_length_foretold_is_that_of_the_layers(side: int, stride: int) -> None:
    expected = _length(side, stride)
    size = (side, 20 * stride)
    network = TrajectoryNet(expected, size, TrajectoryNetSettings(first_stride=stride))
    assert network(torch.zeros(1, *size)).shape == (1, expected)


def test_sizes_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ZooError, match="120 x 160 with first stride 2 give 2 x 3 numbers"):
        TrajectoryNet(20, (120, 160), TrajectoryNetSettings())
