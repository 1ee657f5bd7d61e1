from __future__ import annotations

import numpy as np
import pytest

from graspe_data.geometry import Transform, rotation_from_rpy
from graspe_data.synchronisation.local_map import cell_keys, moved, upright


def test_a_trunk_stands_upright_and_the_ground_round_it_does_not() -> None:
    random = np.random.default_rng(0)
    ground = np.column_stack([random.uniform(-10, 10, (2000, 2)), random.normal(0, 0.02, 2000)])
    trunk = np.column_stack([np.full((20, 2), 4.5), np.linspace(0.1, 1.9, 20)])
    found = upright(np.vstack([ground, trunk]))
    assert found[-20:].all()
    far = np.abs(ground[:, :2] - 4.5).max(axis=1) > 0.6
    assert not found[:2000][far].any()


@pytest.mark.parametrize(("slope", "expected"), [(0.1, False), (1.0, True)])
def test_a_gentle_slope_is_ground_and_a_bank_is_upright(slope: float, expected: bool) -> None:
    x, y = np.meshgrid(np.arange(0.05, 4, 0.1), np.arange(0.05, 4, 0.1))
    points = np.stack([x, y, slope * x + 0.2], axis=-1).reshape(-1, 3)
    assert bool(np.mean(upright(points)) > 0.5) is expected


def test_no_points_are_none() -> None:
    assert upright(np.zeros((0, 3))).shape == (0,)


def test_cells_on_both_sides_of_zero_have_keys_of_their_own() -> None:
    side = np.arange(-8, 8)
    cells = np.stack(np.meshgrid(side, side, side), axis=-1).reshape(-1, 3)
    assert np.unique(cell_keys(cells)).size == 16**3


def test_moved_is_the_transform() -> None:
    transform = Transform(rotation_from_rpy(0.1, -0.4, 2.0), np.array([1.0, -2.0, 0.5]))
    points = np.random.default_rng(3).uniform(-50, 50, (100, 3))
    assert moved(points, transform) == pytest.approx(transform.apply(points), abs=1e-12)
