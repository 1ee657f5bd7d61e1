"""Equations (8) to (10): kernels and how they are stamped."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from graspe_data.errors import ObservationError
from graspe_data.observation.intensity_map.inflation import (
    InflationSettings,
    goal_line,
    inflate,
    inflation_kernel,
)
from tests.graspe_data.observation.intensity_map.slow_reference import slow_inflation, slow_kernel

DEFAULT = InflationSettings()
goals = st.tuples(st.floats(-9, 9), st.floats(-9, 9)).filter(lambda goal: math.hypot(*goal) > 0.1)


@given(
    goal=goals,
    half=st.integers(0, 10),
    width=st.sampled_from([0.0, 1.0, 2.0, 3.3]),
    disc=st.sampled_from([0.0, 1.0, 2.5]),
)
def test_the_kernel_agrees_exactly_with_a_loop_over_its_cells(
    goal: tuple[float, float], half: int, width: float, disc: float
) -> None:
    chosen = InflationSettings(cells=2 * half + 1, half_width=width, disc=disc)
    expected = slow_kernel(goal, chosen.cells, width, disc)
    assert np.array_equal(inflation_kernel(goal, chosen), expected == 1)


@settings(deadline=None, max_examples=30)
@given(goal=goals, seed=st.integers(0, 100), form=st.sampled_from(["adaptive", "uniform"]))
def test_inflation_agrees_exactly_with_stamping_one_obstacle_after_the_other(
    goal: tuple[float, float], seed: int, form: Any
) -> None:
    random = np.random.default_rng(seed)
    obstacles = (random.random((30, 30)) * (random.random((30, 30)) < 0.03)).astype(np.float32)
    kernel = inflation_kernel(goal, InflationSettings(form=form))
    found = inflate(obstacles, kernel)
    assert np.array_equal(found, slow_inflation(obstacles, kernel))
    assert (found >= obstacles).all()


@given(goal=goals)
def test_the_line_is_the_same_turned_by_half_a_turn_and_the_tail_is_not(
    goal: tuple[float, float],
) -> None:
    line, kernel = goal_line(goal, DEFAULT), inflation_kernel(goal, DEFAULT)
    assert np.array_equal(line, line[::-1, ::-1])
    assert not np.array_equal(kernel, kernel[::-1, ::-1])
    assert kernel[5, 5]


@pytest.mark.parametrize(
    ("goal", "towards"),
    [((5, 0), (1, 0)), ((-5, 0), (-1, 0)), ((0, 5), (0, 1)), ((0, -5), (0, -1))],
)
def test_an_obstacle_grows_towards_where_the_robot_comes_from(
    goal: tuple[float, float], towards: tuple[int, int]
) -> None:
    obstacles = np.zeros((41, 41), np.float32)
    obstacles[20, 20] = 1
    grown = np.argwhere(inflate(obstacles, inflation_kernel(goal, DEFAULT))) - 20
    along = grown @ towards
    assert (along.min(), along.max()) == (-2, 5)
    assert np.abs(grown @ towards[::-1]).max() == 2


def test_a_passage_stays_open_for_the_goal_behind_it_and_uniform_inflation_closes_it() -> None:
    wall = np.zeros((41, 41), np.float32)
    wall[20], wall[20, 16:25] = 1, 0
    for form, free in (("adaptive", True), ("uniform", False)):
        kernel = inflation_kernel((5, 0), InflationSettings(form=form))
        assert bool((inflate(wall, kernel)[:, 20] == 0).all()) == free


def test_uniform_inflation_knows_no_goal() -> None:
    assert inflation_kernel((0, 0), InflationSettings(form="uniform")).all()


@pytest.mark.parametrize("goal", [(0.0, 0.0), (math.nan, 1.0), (math.inf, 0.0)])
def test_a_goal_without_direction_is_refused(goal: tuple[float, float]) -> None:
    with pytest.raises(ObservationError, match="no direction from the robot"):
        inflation_kernel(goal, DEFAULT)


def test_a_kernel_without_a_middle_is_refused() -> None:
    with pytest.raises(ValidationError, match="cells 10 is even"):
        InflationSettings(cells=10)
