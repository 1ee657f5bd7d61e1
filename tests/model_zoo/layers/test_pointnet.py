from __future__ import annotations

from typing import TypeVar

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import nn

from model_zoo.layers.pointnet import (
    PointNet,
    PointNetSettings,
    PointNetTrunk,
    PointwiseMaximum,
    PointwiseStack,
    orthogonality_penalty,
)

Module = TypeVar("Module", bound=nn.Module)
SMALL = PointNetSettings(channels=(8, 16, 32), hidden=(16, 8), chunk=10)


def parameters(module: nn.Module | None) -> int:
    assert module is not None
    return sum(parameter.numel() for parameter in module.parameters())


def settled(module: Module) -> Module:
    """With running statistics that are not those of the start, and out of training."""
    for part in module.modules():
        if isinstance(part, nn.BatchNorm1d | nn.BatchNorm2d):
            nn.init.uniform_(part.get_buffer("running_mean"), -1, 1)
            nn.init.uniform_(part.get_buffer("running_var"), 0.5, 2)
            nn.init.normal_(part.weight)
            nn.init.normal_(part.bias)
    return module.eval()


def test_published_counts() -> None:
    whole = PointNetTrunk(PointNetSettings())
    assert parameters(whole) == 2_803_529
    assert parameters(whole.align_input) == 803_081
    assert parameters(PointNetTrunk(PointNetSettings(align_features=False))) == 946_185


def test_a_folded_layer_is_the_convolution_it_stands_for() -> None:
    torch.manual_seed(0)
    stack = settled(PointwiseStack((3, 7, 5), last_relu=False))
    x = torch.randn(2, 11, 3)
    layers: list[nn.Module] = []
    activations = (nn.ReLU(), nn.Identity())
    for sizes, part, activation in zip(((3, 7), (7, 5)), stack.layers, activations, strict=True):
        linear, norm = (part.get_submodule(name).state_dict() for name in ("linear", "norm"))
        convolution, normalisation = nn.Conv1d(*sizes, 1), nn.BatchNorm1d(sizes[1])
        convolution.load_state_dict(linear | {"weight": linear["weight"][:, :, None]})
        normalisation.load_state_dict(norm)
        layers += [convolution, normalisation, activation]
    peer = nn.Sequential(*layers)
    torch.testing.assert_close(stack(x), peer.eval()(x.mT).mT, atol=1e-5, rtol=1e-5)
    torch.testing.assert_close(stack.train()(x), peer.train()(x.mT).mT, atol=1e-5, rtol=1e-5)


@settings(max_examples=20, deadline=None)
@given(st.integers(1, 60), st.integers(1, 70))
def test_chunks_change_nothing(points: int, chunk: int) -> None:
    torch.manual_seed(points)
    maximum = settled(PointwiseMaximum((3, 8, 6), chunk, last_relu=False))
    x = torch.randn(2, points, 3)
    torch.testing.assert_close(maximum(x), maximum.stack(x).amax(1))


def test_order_and_repetition_of_points_change_nothing() -> None:
    network = settled(PointNet(5, SMALL))
    x = torch.randn(2, 23, 3)
    shuffled = torch.cat([x, x[:, :4]], dim=1)[:, torch.randperm(27)]
    torch.testing.assert_close(network(x).vector, network(shuffled).vector)


def test_alignment_starts_at_the_identity() -> None:
    trunk = PointNetTrunk(SMALL)
    transform = trunk(torch.randn(4, 9, 3)).transform
    torch.testing.assert_close(transform, torch.eye(8).expand(4, 8, 8))
    penalty = orthogonality_penalty(transform)
    assert penalty < 1e-5
    penalty.backward()  # type: ignore[no-untyped-call]
    assert all(p.grad is None or p.grad.isfinite().all() for p in trunk.parameters())


def test_the_penalty_is_zero_for_rotations_only() -> None:
    rotation, _ = torch.linalg.qr(torch.randn(3, 8, 8))
    assert orthogonality_penalty(rotation) < 1e-5
    expected = 3 * 8**0.5  # |4 I - I| of 8 x 8
    torch.testing.assert_close(orthogonality_penalty(2 * rotation), torch.tensor(expected))


@pytest.mark.parametrize("align", [True, False])
def test_every_parameter_learns(align: bool) -> None:
    network = PointNet(5, SMALL.model_copy(update={"align_input": align, "align_features": align}))
    optimiser = torch.optim.SGD(network.parameters(), lr=0.1)
    for _ in range(2):  # what starts at zero lets nothing through to the layers before it
        optimiser.zero_grad()
        network(torch.randn(6, 30, 3)).vector.square().sum().backward()
        optimiser.step()
    assert all(p.grad is not None for p in network.parameters())
    weights = [p for name, p in network.named_parameters() if name.endswith("weight")]
    assert all(p.grad is not None and p.grad.any() for p in weights)


def test_ten_thousand_points_never_hold_all_activations() -> None:
    maximum = PointwiseMaximum((3, 64, 128, 1024), 1024).eval()
    x = torch.randn(1, 10_000, 3)
    held: list[int] = []
    original = maximum.stack.folded
    maximum.stack.folded = lambda part, layers: held.append(part.shape[1]) or original(part, layers)  # type: ignore[assignment, method-assign, func-returns-value]
    with torch.inference_mode():
        assert maximum(x).shape == (1, 1024)
    assert sum(held) == 10_000
    assert max(held) == 1024
