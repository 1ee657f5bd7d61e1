"""Cells that are barred in the world, and how right a map of them is."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from graspe_data.simulation.truth.cell_counts import CellCounts, CountSettings, count_cells
from graspe_data.simulation.truth.true_cells import TrueCells, true_cells
from graspe_data.simulation.world.obstacles import Obstacle, Obstacles

SIDE, CELL_M = 60, 0.1
CENTRES = (SIDE / 2 - 0.5 - np.arange(SIDE)) * CELL_M
EVERY = CountSettings(nearest=0.0, farthest=9.0, tolerance=0)

POST = Obstacle((2.0, 0.0), (2.0, 0.0), 0.3, "stops", "pillar")
PANE = Obstacle((1.0, -2.0), (1.0, 2.0), 0.01, "stops", "glass")
GRASS = Obstacle((1.0, 1.0), (1.0, 1.0), 0.5, "slows", "grass", 0.6)


def drawn(*obstacles: Obstacle, pose: tuple[float, float, float] = (0, 0, 0)) -> TrueCells:
    world: Any = SimpleNamespace(obstacles=Obstacles.of(obstacles))
    return true_cells(world, pose, (0.2, 0.0), SIDE, CELL_M)


def test_a_cell_is_barred_where_its_centre_is_within_half_a_cell_of_a_footprint() -> None:
    barred = drawn(POST, GRASS).barred
    away = np.hypot(CENTRES[:, None] - 2.0, CENTRES[None, :])
    assert (barred == (away <= 0.35)).all()


def test_the_map_turns_with_the_robot() -> None:
    ahead, beside = drawn(POST).barred, drawn(POST, pose=(0.0, 0.0, np.pi / 2)).barred
    assert (np.rot90(ahead, -1) == beside).all()


def test_a_pane_is_seen_and_seen_through_and_a_post_hides_its_back() -> None:
    seen = drawn(POST, PANE)
    rows, _ = np.nonzero(seen.visible)
    x = CENTRES[rows]
    assert (np.abs(x - 1.0) <= 0.06).any()
    assert ((x > 1.6) & (x < 2.0)).any()
    assert not (x > 2.1).any()
    assert (seen.barred | ~seen.visible).all()
    hidden = drawn(POST, Obstacle((2.8, 0.0), (2.8, 0.0), 0.1, "entangles", "bush"))
    assert not hidden.visible[CENTRES > 2.5].any()


@settings(deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(0, 2))
def test_counts_are_those_of_plain_loops(seed: int, tolerance: int) -> None:
    generator, side = np.random.default_rng(seed), 12
    solid, barred, seen = (generator.random((side, side)) < share for share in (0.1, 0.15, 0.5))
    within = CountSettings(nearest=0.15, farthest=0.5, tolerance=tolerance)
    truth = TrueCells(barred, barred & seen)
    counts = count_cells(solid, truth, CELL_M, within)
    called = right = there = found = 0
    for r, c in np.ndindex(side, side):
        x, y = (side / 2 - 0.5 - r) * CELL_M, (side / 2 - 0.5 - c) * CELL_M
        if x <= 0 or not 0.15 <= np.hypot(x, y) <= 0.5:
            continue
        near = np.ix_(*(range(max(k - tolerance, 0), min(k + tolerance + 1, side)) for k in (r, c)))
        called += bool(solid[r, c])
        right += bool(solid[r, c] and barred[near].any())
        there += bool(truth.visible[r, c])
        found += bool(truth.visible[r, c] and solid[near].any())
    assert counts == CellCounts(called, right, there, found)


def test_a_perfect_map_has_an_f_score_of_1_and_half_of_it_two_thirds() -> None:
    truth = drawn(PANE)
    whole = count_cells(truth.barred, truth, CELL_M, EVERY)
    assert whole.f_score == 1.0
    left = truth.barred & (CENTRES[None, :] > 0)
    half = count_cells(left, truth, CELL_M, EVERY)
    assert half.precision == 1.0
    assert half.recall == pytest.approx(0.5, abs=0.03)
    assert half.f_score == pytest.approx(2 / 3, abs=0.03)


def test_where_nothing_was_called_or_there_no_share_is_made_up() -> None:
    empty = CellCounts()
    assert (empty.precision, empty.recall, empty.f_score) == (None, None, None)
    assert CellCounts(4, 0, 0, 0).precision == 0
    assert (CellCounts(4, 0, 3, 0) + CellCounts(0, 0, 1, 0)).f_score == 0
