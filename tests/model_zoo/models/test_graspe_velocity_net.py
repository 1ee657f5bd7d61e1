from __future__ import annotations

import pytest
import torch

from graspe_data.errors import ZooError
from model_zoo.models.graspe import VelocityNet, VelocityNetSettings


def test_the_printed_dilations_give_the_printed_features() -> None:
    network = VelocityNet(20, VelocityNetSettings())
    found = [layer.dilation for layer in network.convolutions]
    assert found == [(3,), (2,), (2,), (2,)]
    assert network(torch.randn(3, 50, 2)).shape == (3, 20)


def test_it_is_linear() -> None:
    network = VelocityNet(20, VelocityNetSettings()).double()
    a, b, zero = (
        torch.randn(2, 50, 2).double(),
        torch.randn(2, 50, 2).double(),
        torch.zeros(2, 50, 2),
    )
    offset = network(zero.double())
    torch.testing.assert_close(network(a + b) + offset, network(a) + network(b))


def test_every_step_counts() -> None:
    network = VelocityNet(20, VelocityNetSettings())
    history = torch.randn(1, 50, 2, requires_grad=True)
    network(history).square().sum().backward()
    assert history.grad is not None
    assert history.grad.ne(0).all()


def test_the_variance_of_what_comes_in_is_kept() -> None:
    torch.manual_seed(0)
    network = VelocityNet(20, VelocityNetSettings())
    assert 0.3 < network(torch.randn(500, 50, 2)).std() < 3


def test_sizes_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ZooError, match=r"VelNet: 40 steps, kernel 11 .* expected 20"):
        VelocityNet(20, VelocityNetSettings(steps=40))
    with pytest.raises(ZooError, match="give 10 x 3 numbers, expected 20"):
        VelocityNet(20, VelocityNetSettings(channels=(8, 8, 8, 3)))
