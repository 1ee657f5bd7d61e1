"""Telling the trajectories in one scene apart."""

from __future__ import annotations

import math
from itertools import permutations

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch import Tensor

from model_zoo.training.ranking import ranking_loss


def drawn(seed: int, scenes: int, number: int, steps: int) -> tuple[Tensor, Tensor, Tensor]:
    draw = torch.Generator().manual_seed(seed)
    shape = (scenes * number, steps)
    success = torch.randint(0, 2, shape, generator=draw).float()
    mask = torch.rand(shape, generator=draw) < 0.7
    return torch.randn(shape, generator=draw) * 3, success, mask


def by_pairs(logits: Tensor, success: Tensor, mask: Tensor, scenes: int) -> float:
    number, found = len(logits) // scenes, []
    for scene in range(scenes):
        rows = range(scene * number, (scene + 1) * number)
        for good, bad in permutations(rows, 2):
            for step in range(logits.shape[1]):
                judged = mask[good, step] and mask[bad, step]
                if judged and success[good, step] == 1 and success[bad, step] == 0:
                    apart = float(logits[good, step] - logits[bad, step])
                    found.append(math.log1p(math.exp(-apart)))
    return sum(found) / len(found) if found else 0.0


@given(st.integers(0, 10**6), st.integers(1, 4), st.integers(1, 5), st.integers(1, 4))
def test_it_is_the_mean_over_pairs_of_which_one_fails(
    seed: int, scenes: int, number: int, steps: int
) -> None:
    logits, success, mask = drawn(seed, scenes, number, steps)
    found = float(ranking_loss(logits, success, mask, scenes))
    assert found == pytest.approx(by_pairs(logits, success, mask, scenes), rel=1e-5, abs=1e-6)


def test_how_hard_a_scene_is_does_not_matter() -> None:
    logits, success, mask = drawn(1, 3, 4, 5)
    harder = logits + torch.tensor([0.0, 7.0, -4.0]).repeat_interleave(4)[:, None]
    torch.testing.assert_close(
        ranking_loss(harder, success, mask, 3), ranking_loss(logits, success, mask, 3)
    )


def test_without_a_pair_it_is_zero_and_has_a_gradient() -> None:
    logits = torch.zeros(6, 2, requires_grad=True)
    loss = ranking_loss(logits, torch.ones(6, 2), torch.ones(6, 2, dtype=torch.bool), 2)
    loss.backward()  # type: ignore[no-untyped-call]
    assert loss.item() == 0
    assert logits.grad is not None
    assert not logits.grad.any()
