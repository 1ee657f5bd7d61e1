from __future__ import annotations

import math
from collections.abc import Callable

import pytest
import torch

from model_zoo.contract import Observation


@pytest.fixture(autouse=True)
def _seeded() -> None:
    torch.manual_seed(0)


@pytest.fixture
def observe() -> Callable[[int], Observation]:
    """Rows with every column that a model may ask for, as they lie in a dataset."""

    def draw(rows: int) -> Observation:
        count = torch.randint(0, 9000, (rows,), dtype=torch.int32)
        points = torch.randn(rows, 10_000, 3)
        points[torch.arange(10_000) >= count[:, None]] = math.nan
        scan = torch.rand(rows, 720) * 10
        scan[:, ::7] = math.inf
        return {
            "image": torch.randint(0, 256, (rows, 240, 320, 3), dtype=torch.uint8),
            "points": points,
            "point_count": count,
            "laser_scan": scan,
            "velocity_history": torch.randn(rows, 50, 2),
            "trajectory_image": torch.rand(rows, 240, 320) > 0.9,
            "r_img": torch.rand(rows),
            "r_point": torch.rand(rows),
        }

    return draw
