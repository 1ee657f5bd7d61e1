"""Equation (7): glass stays where it was seen, and fades."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from graspe_data.observation.intensity_map.glass import GlassSettings
from graspe_data.observation.intensity_map.glass_memory import GlassMemory, remember_glass

CELL, SECOND = 0.05, 10**9
NOTHING = np.zeros((80, 80), np.float32)
LASTING = GlassSettings(memory_s=1e6)


def pane(forward: float, left: float = 0.0) -> NDArray[np.float32]:
    """Glass of strength 0.5 in the 3 x 3 cells about a place, metres."""
    values = NOTHING.copy()
    row, column = int(40 - forward / CELL), int(40 - left / CELL)
    values[row - 1 : row + 2, column - 1 : column + 2] = 0.5
    return values


def place_of(values: NDArray[np.float32]) -> tuple[float, float]:
    """The middle of all glass: metres forward and to the left."""
    row, column = np.argwhere(values).mean(axis=0)
    return (39.5 - row) * CELL, (39.5 - column) * CELL


def drive(
    poses: list[tuple[float, float, float]], settings: GlassSettings = LASTING
) -> NDArray[np.float32]:
    """See the pane 1 m ahead at the first pose, drive on, and tell what is known at the last."""
    seen, memory = remember_glass(None, pane(1.0), poses[0], 0, CELL, settings)
    for number, pose in enumerate(poses[1:]):
        seen, memory = remember_glass(memory, NOTHING, pose, number * SECOND // 10, CELL, settings)
    return seen


def test_the_first_map_is_what_is_seen() -> None:
    fresh = pane(1.0, 0.4)
    seen, _ = remember_glass(None, fresh, (3.33, -7.77, 1.0), 0, CELL, LASTING)
    assert np.array_equal(seen, fresh)


def test_a_robot_that_stands_sums_up_to_the_maximum() -> None:
    memory: GlassMemory | None = None
    found = []
    for number in range(4):
        seen, memory = remember_glass(memory, pane(1), (0, 0, 0), number, CELL, LASTING)
        found.append(float(seen.max()))
    assert found == pytest.approx([0.5, 1.0, 1.0, 1.0])


@pytest.mark.parametrize("steps", [1, 7, 100])
def test_many_small_motions_end_where_one_large_one_does(steps: int) -> None:
    poses = [(0.6 * k / steps, 0.2 * k / steps, 0.5 * k / steps) for k in range(steps + 1)]
    ahead, left = place_of(drive(poses))
    x, y = place_of(pane(1.0))
    x, y = x - 0.6, y - 0.2
    expected = (
        math.cos(0.5) * x + math.sin(0.5) * y,
        math.cos(0.5) * y - math.sin(0.5) * x,
    )
    assert (ahead, left) == pytest.approx(expected, abs=0.75 * CELL)


@settings(deadline=None, max_examples=30)
@given(x=st.floats(-30, 30), y=st.floats(-30, 30), yaw=st.floats(-4, 4))
def test_a_turn_and_back_changes_a_place_by_less_than_a_cell(
    x: float, y: float, yaw: float
) -> None:
    start = (x, y, yaw)
    found = place_of(drive([start, (x, y, yaw + 1.3), start]))
    assert found == pytest.approx(place_of(pane(1.0)), abs=CELL)


def test_fades_exponentially_and_is_forgotten_in_the_end() -> None:
    chosen = GlassSettings(memory_s=2.0, faintest=0.02)
    _, memory = remember_glass(None, pane(1), (0, 0, 0), 0, CELL, chosen)
    for seconds, expected in ((1, 0.5 * math.exp(-0.5)), (6, 0.5 * math.exp(-3)), (7, 0)):
        seen, _ = remember_glass(memory, NOTHING, (0, 0, 0), seconds * SECOND, CELL, chosen)
        assert seen.max() == pytest.approx(expected, abs=1e-6)


def test_forgetting_does_not_depend_on_the_rate_of_the_clouds() -> None:
    chosen = GlassSettings(memory_s=2.0, faintest=0.0)
    _, memory = remember_glass(None, pane(1), (0, 0, 0), 0, CELL, chosen)
    for step in range(1, 11):
        seen, memory = remember_glass(memory, NOTHING, (0, 0, 0), step * SECOND // 10, CELL, chosen)
    assert seen.max() == pytest.approx(0.5 * math.exp(-0.5), rel=1e-5)


def test_a_memory_changes_nothing_that_it_is_given() -> None:
    _, memory = remember_glass(None, pane(1), (0, 0, 0), 0, CELL, LASTING)
    before = memory.glass.copy()
    remember_glass(memory, pane(0.5), (0.3, 0.1, 0.2), SECOND, CELL, GlassSettings(memory_s=0.1))
    assert np.array_equal(memory.glass, before)


def test_time_that_runs_back_begins_anew() -> None:
    _, memory = remember_glass(None, pane(1), (0, 0, 0), SECOND, CELL, LASTING)
    seen, _ = remember_glass(memory, NOTHING, (0, 0, 0), 0, CELL, LASTING)
    assert not seen.any()
