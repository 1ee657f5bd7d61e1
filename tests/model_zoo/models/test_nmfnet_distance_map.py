from __future__ import annotations

import math

import cv2
import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from graspe_data.errors import ZooError
from graspe_data.observation.laser_scan import LaserScanSettings, laser_scan
from model_zoo.models.nmfnet import DistanceMap

BEAMS = 720


def scans() -> st.SearchStrategy[torch.Tensor]:
    distance = st.one_of(st.just(math.inf), st.floats(0.5, 10, width=32))
    return st.lists(distance, min_size=36, max_size=36).map(
        lambda values: torch.tensor(values).repeat_interleave(BEAMS // 36)[None]
    )


@settings(max_examples=20, deadline=None)
@given(scans())
def test_every_pixel_is_what_its_ray_says(scan: torch.Tensor) -> None:
    drawn = DistanceMap(20, 10.0, BEAMS)(scan)[0, 0]
    for row in range(20):
        for column in range(20):
            x, y = 10 - (row + 0.5) * 0.5, 5 - (column + 0.5) * 0.5
            if x == abs(y):  # between two rays
                continue
            first = scan[0, math.floor(math.degrees(math.atan2(y, x)) / 0.25 + 360)].item()
            expected = 0.5 if math.isinf(first) else float(math.hypot(x, y) < first)
            assert drawn[row, column] == expected


@settings(max_examples=20, deadline=None)
@given(scans())
def test_mirroring_the_scan_mirrors_the_map(scan: torch.Tensor) -> None:
    draw = DistanceMap(200, 10.0, BEAMS)
    torch.testing.assert_close(draw(scan.flip(1)), draw(scan).flip(3))


def test_the_free_ground_is_the_polygon_that_the_scan_spans() -> None:
    azimuth = (np.arange(BEAMS) + 0.5) * np.pi / BEAMS - np.pi / 2
    scan = 5 + 3 * np.sin(3 * azimuth)
    x, y = scan * np.cos(azimuth), scan * np.sin(azimuth)
    corners = np.stack(((5 - y) / 0.05 - 0.5, (10 - x) / 0.05 - 0.5), axis=1)
    corners = np.vstack((corners, [[99.5, 199.5]]))
    polygon = np.zeros((200, 200), np.uint8)
    cv2.fillPoly(polygon, [np.rint(corners).astype(np.int32)], 1)
    drawn = DistanceMap(200, 10.0, BEAMS)(torch.from_numpy(scan).float()[None])[0, 0].numpy()
    assert np.mean(drawn == polygon) > 0.985
    assert set(np.unique(drawn)) == {0.0, 1.0}


def test_a_wall_on_the_left_is_drawn_on_the_left() -> None:
    y, x = np.meshgrid(np.linspace(1, 4, 200), np.linspace(1.8, 2.2, 5))
    wall = np.stack((x.ravel(), y.ravel(), np.zeros(x.size)), axis=1).astype(np.float32)
    scan = torch.from_numpy(laser_scan(wall, 0.5, LaserScanSettings()))[None]
    drawn = DistanceMap(200, 10.0, BEAMS)(scan)[0, 0]
    ahead_left, behind_left = drawn[180, 80], drawn[140, 60]
    assert (ahead_left, behind_left) == (1.0, 0.0)
    assert torch.all(drawn[:, 100:] == 0.5)


def test_the_lookup_is_no_part_of_the_weights() -> None:
    assert not DistanceMap(20, 10.0, BEAMS).state_dict()


def test_a_narrow_scan_is_refused() -> None:
    with pytest.raises(ZooError, match="expected pi at least"):
        DistanceMap(20, 10.0, 360, half_angle=0.8)
