from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
import pytest
import torch
from torch import Tensor

from graspe_data.observation.image_reliability import ImageReliabilitySettings, image_reliability
from graspe_data.observation.point_reliability import PointReliabilitySettings, point_reliability

POINTS = 400


@pytest.fixture
def make_batch() -> Callable[..., dict[str, Tensor]]:
    """Rows of all columns with small pictures; reliabilities as the pipeline computes them."""

    def make(rows: int = 3, seed: int = 0) -> dict[str, Tensor]:
        random = np.random.default_rng(seed)
        rough = random.integers(0, 256, (rows, 60, 80, 3)).astype(np.uint8)
        image = np.stack([cv2.GaussianBlur(one, (0, 0), 0.8) for one in rough])
        count = random.integers(POINTS // 2, POINTS, rows).astype(np.int32)
        padding = np.arange(POINTS) >= count[:, None]
        azimuth = np.sort(random.uniform(-np.pi / 2, np.pi / 2, (rows, POINTS)))
        distance = random.uniform(1, 20, (rows, POINTS))
        height = random.uniform(-0.3, 2, (rows, POINTS))
        x, y = distance * np.cos(azimuth), distance * np.sin(azimuth)
        points = np.stack([x, y, height], axis=2).astype(np.float32)
        smoothness = random.choice([0.001, 0.05, 0.5], (rows, POINTS)).astype(np.float32)
        intensity = random.random((rows, POINTS), np.float32)
        for column in (points, smoothness, intensity):
            column[padding] = np.nan
        scan = random.uniform(0.3, 10, (rows, 720)).astype(np.float32)
        scan[random.random((rows, 720)) < 0.2] = np.inf
        batch = {
            "image": image,
            "points": points,
            "intensity": intensity,
            "smoothness": smoothness,
            "point_count": count,
            "laser_scan": scan,
            "velocity_history": random.standard_normal((rows, 50, 2)).astype(np.float32),
            "trajectory_image": random.random((rows, 60, 80)) < 0.2,
            "stamp_ns": np.arange(rows) * 100_000_000 + 1_700_000_000_000_000_000,
            "success": np.ones((rows, 10), np.uint8),
        }
        pictures = [image_reliability(one, ImageReliabilitySettings()) for one in image]
        clouds = [point_reliability(one, PointReliabilitySettings()) for one in smoothness]
        for found in (pictures, clouds):
            for name in vars(found[0]):
                batch[name] = np.array([getattr(one, name) for one in found], np.float32)
        return {name: torch.from_numpy(column) for name, column in batch.items()}

    return make
