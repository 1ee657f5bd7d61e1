from __future__ import annotations

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import nn

from graspe_data.errors import ZooError
from model_zoo.models.graspe import TrajectoryNet, TrajectoryNetSettings, _length


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


@settings(max_examples=30, deadline=None)
@given(
    st.integers(100, 150),
    st.integers(100, 150),
    st.sampled_from([1, 2, 3]),
    st.floats(0, 0.02),
    st.integers(0, 99),
)
def test_windows_that_are_crossed_are_enough(
    height: int, width: int, stride: int, share: float, seed: int
) -> None:
    generator = torch.Generator().manual_seed(seed)
    outputs = _length(height, stride) * _length(width, stride)
    network = TrajectoryNet(outputs, (height, width), TrajectoryNetSettings(first_stride=stride))
    for weight in network.parameters():
        nn.init.normal_(weight, generator=generator)
    lines = (torch.rand(3, height, width, generator=generator) < share).float()
    gradients = []
    for training in (True, False):
        network.train(training).zero_grad()
        numbers = network(lines)
        numbers.square().sum().backward()
        gradients.append([weight.grad for weight in network.parameters()])
        torch.testing.assert_close(numbers, network.eval()(lines), rtol=1e-5, atol=1e-5)
    for crossed, whole in zip(*gradients, strict=True):
        torch.testing.assert_close(crossed, whole, rtol=1e-3, atol=1e-3)


def test_at_first_what_comes_out_tells_where_the_line_runs() -> None:
    torch.manual_seed(0)
    network = TrajectoryNet(20, (120, 160), TrajectoryNetSettings(first_stride=1))
    lines = torch.zeros(3, 120, 160)
    lines[0, 60:, 20:40] = 1
    lines[1, 60:, 120:140] = 1
    left, right, nothing = network(lines).detach().view(3, 4, 5)
    assert (left[:, :2] > right[:, :2]).any()
    assert (right[:, 3:] > left[:, 3:]).any()
    assert (left >= nothing).all()
    torch.testing.assert_close(nothing, torch.zeros(4, 5))
