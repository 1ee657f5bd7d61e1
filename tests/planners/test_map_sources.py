"""The maps that planners drive by, of clouds whose returns are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from graspe_data.errors import PlannerError
from graspe_data.geometry import Transform
from graspe_data.robot import Robot
from graspe_data.sensor_data import Motion, PointCloud
from planners.cost_map import CostMap, MapSource, cells_at, values_at
from planners.glass_slam_source import GlassSlamSource
from planners.intensity_source import IntensitySource
from planners.occupancy_source import OccupancyMapSettings, OccupancySource, occupied_cells
from planners.pose_at import pose_at
from planners.situation import Situation
from tests.planners.conftest import NOW, Situations

MOUNTING = Transform(np.eye(3), np.array([0.2, 0.0, 0.35]))
SECOND = 10**9
Points = NDArray[np.float64]


@pytest.fixture(autouse=True)
def few_returns(monkeypatch: pytest.MonkeyPatch) -> None:
    """The clouds here have some twenty returns, and are a lidar's that sees."""
    monkeypatch.setattr("planners.lidar_clouds.blind", lambda *_: "")


def column(x: float, y: float, strength: float, heights: tuple[float, ...]) -> Points:
    """Returns above each other; x and y in base_link, heights from the lidar's plane."""
    return np.array([(x - 0.2, y, z, strength) for z in heights])


WALL = np.concatenate([column(2.02, y, 230, (-0.4, 0.0, 0.4)) for y in np.arange(-1, 1, 0.02)])
GRASS = np.concatenate([column(2.02, y, 35, (-0.4, 0.0, 0.4)) for y in np.arange(-1, 1, 0.07)])
GLINT = np.concatenate([column(2.02, y, 115, (0.0,)) for y in np.arange(-0.15, 0.15, 0.02)])
FAR = column(4.5, 3.0, 200, (-0.3, -0.2, 0.0, 0.2, 0.3))


def seen(
    base: Situation, *returns: Points, stamp_ns: int = NOW, pose: tuple[float, float, float]
) -> Situation:
    points = np.concatenate([FAR, *returns]).astype(np.float32)
    ring = np.where(points[:, 2] < 0, 0, np.where(points[:, 2] > 0, 15, 8)).astype(np.int32)
    cloud = PointCloud(stamp_ns, "lidar", points[:, :3], points[:, 3], ring)
    return replace(base, cloud=cloud, now_ns=stamp_ns, pose=pose, motions=())


def straight_ahead(made: CostMap, x: float) -> tuple[float, bool]:
    place = np.array([x, 0.0])
    cost = values_at(made.cost, place, made.cell_m)
    return float(cost), bool(values_at(made.solid, place, made.cell_m))


def test_cells_lie_as_their_rows_and_columns_say() -> None:
    row, column_ = cells_at(np.array([[0.98, 0.98], [-0.98, 0.02], [3.0, 0.0]]), 4, 0.5)
    assert row.tolist() == [0, 3, -4]
    assert column_.tolist() == [0, 1, 2]
    values = np.arange(16).reshape(4, 4)
    assert values_at(values, np.array([[0.98, 0.98], [3.0, 0.0]]), 0.5).tolist() == [0, 0]
    assert values_at(values, np.array([[-0.98, -0.98]]), 0.5).tolist() == [15]


def test_a_wall_is_solid_and_grass_costs_little(robot: Robot, situation: Situations) -> None:
    for returns, least, most, solid in ((WALL, 0.9, 1.0, True), (GRASS, 0.05, 0.6, False)):
        made = IntensitySource(robot, MOUNTING).cost_map(
            seen(situation(), returns, pose=(0.0, 0.0, 0.0))
        )
        cost, held = straight_ahead(made, 2.02)
        assert least <= cost <= most
        assert held == solid
        assert bool(values_at(made.barred, np.array([1.8, 0.0]), made.cell_m)) == solid


def test_glass_is_remembered_where_it_was_seen(robot: Robot, situation: Situations) -> None:
    source = IntensitySource(robot, MOUNTING)
    for step in range(3):
        ask = seen(situation(), GLINT, stamp_ns=NOW + step * SECOND // 5, pose=(0.0, 0.0, 0.0))
        source.cost_map(ask)
    later = seen(situation(), stamp_ns=NOW + SECOND, pose=(1.0, 0.0, 0.0))
    made = source.cost_map(later)
    assert straight_ahead(made, 1.02)[1]
    assert not straight_ahead(made, 2.02)[1]
    assert made is source.cost_map(later)
    anew = seen(situation(), stamp_ns=NOW, pose=(1.0, 0.0, 0.0))
    assert (
        not source.cost_map(anew).solid.any() or straight_ahead(source.cost_map(anew), 1.0)[0] < 0.5
    )


def test_uniform_inflation_reaches_to_all_sides(robot: Robot, situation: Situations) -> None:
    ask = seen(situation(), WALL, pose=(0.0, 0.0, 0.0))
    made = OccupancySource(robot, MOUNTING).cost_map(ask)
    assert straight_ahead(made, 2.02) == (1.0, True)
    assert [straight_ahead(made, x)[0] for x in (1.72, 1.78, 2.28, 2.32)] == [0, 1, 1, 0]
    points = made.solid_points()
    assert points[np.abs(points[:, 1]) < 0.5, 0] == pytest.approx(2.025, abs=1e-6)


def test_peaks_stay_in_the_odometry_frame(robot: Robot, situation: Situations) -> None:
    peak = GLINT.copy()
    peak[:, 3] = 10
    peak[7:10, 3] = 200
    source = GlassSlamSource(robot, MOUNTING)
    source.cost_map(seen(situation(), peak, pose=(0.0, 0.0, 0.0)))
    later = seen(situation(), stamp_ns=NOW + 60 * SECOND, pose=(0.0, -1.0, np.pi / 2))
    made = source.cost_map(later)
    # From (2, 0) in the odometry frame to 1 m ahead and 2 m to the right.
    found = made.solid_points()
    assert np.hypot(*(found - (1.0, -2.0)).T).min() < 0.06


@pytest.mark.parametrize("make", [IntensitySource, GlassSlamSource])
def test_a_cloud_without_intensity_is_refused(
    make: type[IntensitySource | GlassSlamSource], robot: Robot, situation: Situations
) -> None:
    source: MapSource = make(robot, MOUNTING)
    with pytest.raises(PlannerError, match="has no intensity"):
        source.cost_map(situation())
    with pytest.raises(PlannerError, match="no cloud"):
        source.cost_map(replace(situation(), cloud=None))


def test_the_pose_of_a_cloud_is_between_those_of_the_odometry(situation: Situations) -> None:
    half = np.sin(np.pi / 4)
    moved = [
        Motion(NOW - 400_000_000, "odom", "base_link", (1.0, 0.0, 0.0), (0, 0, 0, 1.0), 0.5, 0.0),
        Motion(NOW - 200_000_000, "odom", "base_link", (2.0, 2.0, 0.0), (0, 0, half, half), 0, 0),
        Motion(NOW - 100_000_000, "odom", "base_link", None, None, 0.5, 0.0),
    ]
    moment = replace(situation(pose=(2.0, 3.0, np.pi / 2), velocity=(5.0, 0.0)), motions=moved)
    assert pose_at(moment, NOW - 300_000_000) == pytest.approx((1.5, 1.0, np.pi / 4))
    assert pose_at(moment, NOW - 100_000_000) == pytest.approx((2.0, 2.5, np.pi / 2))
    assert pose_at(moment, NOW - 900_000_000) == pytest.approx((1.0, 0.0, 0.0))
    assert pose_at(moment, NOW) == pytest.approx((2.0, 3.0, np.pi / 2))


def test_cells_that_returns_fill() -> None:
    settings = OccupancyMapSettings(size=4, resolution=1.0, minimum_points=2)
    xyz = np.array([[1.2, -0.5, 0.5]] * 2 + [[0.5, 0.5, 0.5]] + [[9.0, 0.0, 0.5]] * 3)
    high = np.array([[-1.5, -1.5, 3.0]] * 2)
    found = occupied_cells(np.concatenate((xyz, high)), 0.0, settings)
    assert np.argwhere(found).tolist() == [[0, 2]]
