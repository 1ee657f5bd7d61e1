"""Points on the ground, by a scan of the cloud."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from graspe_data.errors import PlannerError
from graspe_data.geometry import Transform
from planners.obstacles import ScanObstacles, scan_points
from planners.situation import Situation
from tests.planners.conftest import Situations

LIDAR = Transform(np.eye(3), np.array([0.0, 0.0, 0.3]))
SOURCE = ScanObstacles(LIDAR, 0.5, 0.45)


def test_a_post_is_found_where_it_stands_and_the_ground_is_not(situation: Situations) -> None:
    points = SOURCE.points(situation(posts=((3.0, 1.0),)))
    assert len(points) > 3
    assert np.hypot(*(points - (3.0, 1.0)).T) == pytest.approx(0.1, abs=0.06)


def test_nothing_stands_on_empty_ground(situation: Situations) -> None:
    assert SOURCE.points(situation()).shape == (0, 2)


def test_without_a_cloud_there_is_no_answer(situation: Situations) -> None:
    blind: Situation = replace(situation(), cloud=None)
    with pytest.raises(PlannerError, match="no cloud"):
        SOURCE.points(blind)


def test_rays_end_where_the_scan_says() -> None:
    scan = np.array([np.inf, 2.0, np.inf, 1.0], np.float32)
    points = scan_points(scan, np.pi / 2)
    angles = np.deg2rad([-22.5, 67.5])
    expected = np.stack((np.cos(angles), np.sin(angles)), axis=1) * [[2.0], [1.0]]
    assert points == pytest.approx(expected)
