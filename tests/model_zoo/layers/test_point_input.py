from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from model_zoo.layers.point_input import bounded, choose_points, nearby_points


def rows(*counts: int, size: int) -> tuple[torch.Tensor, torch.Tensor]:
    """Points whose x is their index, NaN past the count."""
    points = torch.arange(size).float()[None, :, None].repeat(len(counts), 1, 3)
    for row, count in enumerate(counts):
        points[row, count:] = torch.nan
    return points, torch.tensor(counts, dtype=torch.int32)


@given(st.integers(0, 40), st.integers(0, 40), st.integers(1, 60))
def test_padding_is_never_chosen_and_use_is_even(first: int, second: int, number: int) -> None:
    chosen = choose_points(*rows(first, second, size=40), number)
    assert chosen.shape == (2, number, 3)
    assert not chosen.isnan().any()
    for count, row in zip((first, second), chosen[:, :, 0], strict=True):
        if count == 0:
            assert not row.any()
            continue
        uses = row.unique(return_counts=True)[1]
        assert uses.numel() == min(count, number)
        assert uses.max() - uses.min() <= 1


def test_more_are_evenly_spaced_and_fewer_repeated_in_turn() -> None:
    chosen = choose_points(*rows(10, 2, size=10), 5)
    assert chosen[0, :, 0].tolist() == [0, 2, 4, 6, 8]
    assert chosen[1, :, 0].tolist() == [0, 1, 0, 1, 0]


def test_as_many_as_wanted_are_taken_as_they_are() -> None:
    points, count = rows(7, size=7)
    assert torch.equal(choose_points(points, count, 7), points)


@given(
    points=arrays(np.float32, (2, 30, 3), elements=st.floats(-9, 9, width=32)),
    counts=st.tuples(st.integers(0, 30), st.integers(0, 30)),
    reach=st.floats(0.5, 9),
)
def test_points_nearby_keep_their_order(
    points: NDArray[np.float32], counts: tuple[int, int], reach: float
) -> None:
    kept, number = nearby_points(torch.from_numpy(points), torch.tensor(counts), reach)
    for row, count in enumerate(counts):
        real = torch.from_numpy(points[row, :count])
        expected = real[(real[:, :2] ** 2).sum(1) < reach**2]
        assert number[row] == len(expected)
        assert torch.equal(kept[row, : number[row]], expected)


def test_what_lies_past_the_count_is_never_near() -> None:
    points = torch.full((1, 4, 3), float("nan"))
    points[0, 1] = 0.5
    kept, number = nearby_points(points, torch.tensor([2]), 4.0)
    assert number.tolist() == [1]
    assert kept[0, 0].tolist() == [0.5, 0.5, 0.5]


@settings(deadline=None)
@given(st.floats(0.01, 1000), st.floats(0.1, 20))
def test_directions_stay_and_lengths_are_bounded(length: float, half_range: float) -> None:
    direction = torch.tensor([2.0, -1.0, 2.0]) / 3
    scaled = bounded(direction * length, half_range)
    torch.testing.assert_close(scaled / scaled.norm(), direction)
    assert scaled.norm().item() == pytest.approx(length / (half_range + length), rel=1e-4)
    assert scaled.norm() < 1


def test_at_half_range_a_length_is_a_half_and_the_origin_stays() -> None:
    scaled = bounded(torch.tensor([[3.0, 0.0, 0.0], [0.0, 0.0, 0.0]]), 3.0)
    torch.testing.assert_close(scaled, torch.tensor([[0.5, 0.0, 0.0], [0.0, 0.0, 0.0]]))
