from __future__ import annotations

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import Tensor, nn

from model_zoo.layers.normalised_maximum import normalised_maximum


def layer(inputs: int, outputs: int) -> tuple[nn.Linear, nn.BatchNorm2d]:
    norm = nn.BatchNorm2d(outputs)
    nn.init.normal_(norm.weight)
    nn.init.normal_(norm.bias)
    return nn.Linear(inputs, outputs), norm


def plainly(x: Tensor, linear: nn.Linear, norm: nn.BatchNorm2d) -> Tensor:
    peer = nn.BatchNorm1d(norm.num_features)
    peer.load_state_dict(norm.state_dict())
    peer.to(x.dtype).weight, peer.bias = norm.weight, norm.bias
    batch, points, _ = x.shape
    return peer(linear(x).flatten(0, 1)).view(batch, points, -1).max(1).values  # type: ignore[no-any-return]


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 4), st.integers(2, 60), st.integers(0, 1000))
def test_is_the_maximum_of_what_it_stands_for(batch: int, points: int, seed: int) -> None:
    torch.manual_seed(seed)
    linear, norm = layer(5, 9)
    x = torch.randn(batch, points, 5) * 3 + 2
    torch.testing.assert_close(
        normalised_maximum(x, linear, norm), plainly(x, linear, norm), atol=2e-4, rtol=2e-4
    )


def test_gradients_are_those_of_what_it_stands_for() -> None:
    torch.manual_seed(0)
    linear, norm = layer(6, 11)
    x = torch.randn(3, 40, 6, requires_grad=True)
    direction = torch.randn(3, 11)
    learned = (x, linear.weight, linear.bias, norm.weight, norm.bias)
    for ours, theirs in zip(
        torch.autograd.grad(
            (normalised_maximum(x, linear, norm) * direction).sum(), learned, allow_unused=True
        ),
        torch.autograd.grad((plainly(x, linear, norm) * direction).sum(), learned),
        strict=True,
    ):
        expected = torch.zeros_like(theirs) if ours is None else ours
        torch.testing.assert_close(expected, theirs, atol=1e-4, rtol=1e-4)


def test_running_statistics_move_as_batch_normalisation_moves_them() -> None:
    torch.manual_seed(0)
    linear, norm = layer(4, 7)
    peer = nn.BatchNorm2d(7)
    x = torch.randn(2, 33, 4) + 1
    for _ in range(3):
        normalised_maximum(x, linear, norm)
        peer(linear(x).permute(0, 2, 1).unsqueeze(-1))
    for name in ("running_mean", "running_var", "num_batches_tracked"):
        torch.testing.assert_close(norm.get_buffer(name), peer.get_buffer(name))


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_far_from_the_origin_it_stays_exact(scale: float) -> None:
    torch.manual_seed(0)
    linear, norm = layer(4, 7)
    x = (torch.randn(2, 500, 4) + 30) * scale
    exact = plainly(x.double(), linear.double(), norm.double())
    ours = normalised_maximum(x, linear.float(), norm.float())
    torch.testing.assert_close(ours.double(), exact, atol=2e-3, rtol=2e-3)
