"""Equation (3), against a slow reading of the paper."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from graspe_data.observation.smoothness import smoothness


def _slowly(
    xyz: NDArray[np.float32], starts: NDArray[np.int64], neighbours: int
) -> NDArray[np.float64]:
    c = np.zeros(len(xyz))
    points = xyz.astype(np.float64)
    for begin, end in pairwise(starts):
        for place in range(begin, end):
            around = range(max(begin, place - neighbours), min(end, place + neighbours + 1))
            others = [k for k in around if k != place]
            total = sum((points[place] - points[k] for k in others), np.zeros(3))
            scale = np.linalg.norm(points[place]) * len(others)
            c[place] = np.linalg.norm(total) / scale if scale else 0.0
    return c


@settings(deadline=None)
@given(
    lengths=st.lists(st.integers(1, 25), min_size=1, max_size=6),
    neighbours=st.integers(1, 6),
    seed=st.integers(0, 1000),
)
def test_agrees_with_the_definition(lengths: list[int], neighbours: int, seed: int) -> None:
    starts = np.concatenate(([0], np.cumsum(lengths)))
    xyz = np.random.default_rng(seed).normal(0, 10, (starts[-1], 3)).astype(np.float32)
    found = smoothness(xyz, starts, neighbours)
    assert found.dtype == np.float32
    assert found == pytest.approx(_slowly(xyz, starts, neighbours), rel=1e-4, abs=1e-5)


def test_vanishes_on_an_even_straight_line_but_at_its_ends() -> None:
    line = np.column_stack((np.full(50, 8.0), np.arange(50) * 0.1, np.zeros(50)))
    c = smoothness(line.astype(np.float32), np.array([0, 50]))
    assert np.all(c[5:-5] < 1e-6)
    assert c[0] == pytest.approx(0.3 / 8, rel=1e-5)


def test_does_not_look_into_the_next_ring() -> None:
    rng = np.random.default_rng(0)
    low, high = rng.normal(0, 5, (2, 40, 3)).astype(np.float32)
    both = smoothness(np.concatenate((low, high)), np.array([0, 40, 80]))
    assert np.array_equal(both[:40], smoothness(low, np.array([0, 40])))
    assert np.array_equal(both[40:], smoothness(high, np.array([0, 40])))


def test_a_point_alone_and_an_empty_cloud() -> None:
    assert smoothness(np.array([[1, 2, 3]], np.float32), np.array([0, 1])).tolist() == [0.0]
    assert len(smoothness(np.empty((0, 3), np.float32), np.array([0]))) == 0
