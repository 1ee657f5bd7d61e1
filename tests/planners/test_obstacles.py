"""Points on the ground, by the scan and by the map."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from graspe_data.errors import PlannerError
from graspe_data.geometry import Transform
from planners.obstacles import MapObstacles, ObstacleSource, ScanObstacles, scan_points
from planners.occupancy_map import OccupancyMapSettings, occupancy_map
from planners.situation import Situation
from tests.planners.conftest import Situations

LIDAR = Transform(np.eye(3), np.array([0.0, 0.0, 0.3]))
SOURCES: list[ObstacleSource] = [ScanObstacles(LIDAR, 0.5, 0.45), MapObstacles(LIDAR, 0.5, 0.45)]


@pytest.mark.parametrize("source", SOURCES)
def test_a_post_is_found_where_it_stands_and_the_ground_is_not(
    source: ObstacleSource, situation: Situations
) -> None:
    points = source.points(situation(posts=((3.0, 1.0),)))
    assert len(points) > 3
    assert np.hypot(*(points - (3.0, 1.0)).T) == pytest.approx(0.1, abs=0.06)


@pytest.mark.parametrize("source", SOURCES)
def test_nothing_stands_on_empty_ground(source: ObstacleSource, situation: Situations) -> None:
    assert source.points(situation()).shape == (0, 2)


@pytest.mark.parametrize("source", SOURCES)
def test_without_a_cloud_there_is_no_answer(source: ObstacleSource, situation: Situations) -> None:
    blind: Situation = replace(situation(), cloud=None)
    with pytest.raises(PlannerError, match="no cloud"):
        source.points(blind)


def test_rays_end_where_the_scan_says() -> None:
    scan = np.array([np.inf, 2.0, np.inf, 1.0], np.float32)
    points = scan_points(scan, np.pi / 2)
    angles = np.deg2rad([-22.5, 67.5])
    expected = np.stack((np.cos(angles), np.sin(angles)), axis=1) * [[2.0], [1.0]]
    assert points == pytest.approx(expected)


def test_cells_of_a_map() -> None:
    settings = OccupancyMapSettings(size=4, resolution=1.0, minimum_points=2)
    xyz = np.array([[1.2, -0.5, 0.5]] * 2 + [[0.5, 0.5, 0.5]] + [[9.0, 0.0, 0.5]] * 3)
    high = np.array([[-1.5, -1.5, 3.0]] * 2)
    found = occupancy_map(np.concatenate((xyz, high)), 0.0, settings)
    assert found.points().tolist() == [[1.5, -0.5]]
