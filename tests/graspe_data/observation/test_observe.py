"""One observation: points in base_link, a scan of the full cloud, and the equations on both."""

from dataclasses import asdict, astuple, replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from pydantic import ValidationError

from graspe_data.errors import ObservationError
from graspe_data.geometry import Transform, rotation_from_rpy
from graspe_data.manifest import find_manifest
from graspe_data.observation.image_reliability import image_reliability
from graspe_data.observation.laser_scan import laser_scan
from graspe_data.observation.observe import PointObservation, observe, observe_points
from graspe_data.observation.point_reliability import point_reliability
from graspe_data.observation.point_sample import PointSampleSettings
from graspe_data.observation.settings import ObservationManifest, PointObservationSettings
from graspe_data.observation.undistortion import rectifier
from graspe_data.robot import Intrinsics, load_robot
from graspe_data.sensor_data import PointCloud

MOUNTED = Transform(rotation_from_rpy(0.01, 0.05, 0.3), np.array([0.2, 0.0, 0.6]))
SETTINGS = PointObservationSettings(sample=PointSampleSettings(count=3000), base_height=0.1)


def _shuffled(cloud: PointCloud, seed: int) -> PointCloud:
    order = np.random.default_rng(seed).permutation(len(cloud.xyz))
    return replace(
        cloud,
        xyz=cloud.xyz[order],
        intensity=None if cloud.intensity is None else cloud.intensity[order],
        ring=None if cloud.ring is None else cloud.ring[order],
    )


def _bytes(observation: PointObservation) -> list[bytes]:
    return [np.asarray(value).tobytes() for value in astuple(observation)]


def test_the_layout_of_the_cloud_in_memory_changes_nothing(cloud: PointCloud) -> None:
    by_axis = replace(cloud, xyz=np.asfortranarray(cloud.xyz))
    every_other = replace(cloud, xyz=np.repeat(cloud.xyz, 2, axis=0)[::2])
    expected = _bytes(observe_points(cloud, MOUNTED, SETTINGS, 5))
    for other in (by_axis, every_other):
        assert _bytes(observe_points(other, MOUNTED, SETTINGS, 5)) == expected


@settings(
    deadline=None, max_examples=15, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(seed=st.integers(0, 10_000), named=st.booleans(), bright=st.booleans())
def test_the_order_of_the_message_changes_nothing(
    cloud: PointCloud, seed: int, named: bool, bright: bool
) -> None:
    doubled = PointCloud(
        0,
        "velodyne",
        np.concatenate((cloud.xyz, cloud.xyz[::7])),
        np.arange(len(cloud.xyz[::7]) + len(cloud.xyz), dtype=np.float32) if bright else None,
        np.concatenate((cloud.ring, cloud.ring[::7])) if named and cloud.ring is not None else None,
    )
    expected = observe_points(doubled, MOUNTED, SETTINGS, 5)
    assert _bytes(expected) == _bytes(
        observe_points(_shuffled(doubled, seed), MOUNTED, SETTINGS, 5)
    )


def test_points_are_in_base_link_in_front_and_from_the_cloud(cloud: PointCloud) -> None:
    found = observe_points(cloud, MOUNTED, SETTINGS, 1)
    assert found.point_count == 3000
    assert np.all(found.points[:, 0] >= 0)
    back = MOUNTED.inverse().apply(found.points.astype(np.float64))
    gaps = [np.abs(cloud.xyz - point).max(axis=1).min() for point in back[::100]]
    assert max(gaps) < 1e-5
    assert np.all((found.intensity >= 0) & (found.intensity <= 1))


def test_the_scan_is_of_the_full_cloud(cloud: PointCloud) -> None:
    moved = MOUNTED.apply(cloud.xyz)
    expected = laser_scan(np.asarray(moved, np.float32), 0.1, SETTINGS.laser_scan)
    found = observe_points(cloud, MOUNTED, SETTINGS, 1).laser_scan
    both = np.isfinite(expected) & np.isfinite(found)
    assert np.mean(np.isfinite(expected) == np.isfinite(found)) > 0.99
    assert np.mean(np.abs(found[both] - expected[both]) < 1e-4) > 0.99


def test_another_seed_draws_other_points(cloud: PointCloud) -> None:
    first, second = (observe_points(cloud, MOUNTED, SETTINGS, seed) for seed in (1, 2))
    assert not np.array_equal(first.points, second.points)
    assert np.array_equal(first.laser_scan, second.laser_scan)


def test_returns_from_the_robot_itself_and_damaged_ones_do_not_count(cloud: PointCloud) -> None:
    assert cloud.ring is not None
    added: NDArray[np.float32] = np.array([[0.1, 0, 0], [3e30, 1, 1], [-3e38, 0, 0]], np.float32)
    noisy = PointCloud(
        0,
        "velodyne",
        np.concatenate((added, cloud.xyz)),
        None,
        np.concatenate((np.zeros(3, np.int32), cloud.ring)),
    )
    guarded = SETTINGS.model_copy(update={"minimum_range": 0.3})
    clean = observe_points(replace(cloud, intensity=None), MOUNTED, guarded, 1)
    assert _bytes(observe_points(noisy, MOUNTED, guarded, 1)) == _bytes(clean)


@pytest.mark.parametrize("ring", [None, np.zeros(0, np.int32)])
def test_an_empty_cloud_is_all_padding(ring: NDArray[np.int32] | None) -> None:
    nothing = PointCloud(0, "velodyne", np.zeros((0, 3), np.float32), None, ring)
    found = observe_points(nothing, MOUNTED, SETTINGS, 1)
    assert found.point_count == 0
    assert np.isnan(found.points).all()
    assert np.isinf(found.laser_scan).all()


def test_a_field_that_holds_no_ring_numbers_is_refused() -> None:
    total = 70_000
    xyz = np.random.default_rng(0).normal(0, 5, (total, 3)).astype(np.float32)
    xyz[:, 0] = 1 + np.abs(xyz[:, 0])
    cloud = PointCloud(0, "velodyne", xyz, None, np.arange(total, dtype=np.int32))
    with pytest.raises(ObservationError, match="no ring number"):
        observe_points(cloud, MOUNTED, SETTINGS, 1)


def test_a_nearest_return_beyond_the_furthest_is_refused() -> None:
    with pytest.raises(ValidationError, match=r"minimum_range 2000\.0 is above maximum_range"):
        PointObservationSettings(minimum_range=2000.0)


def test_a_picture_and_a_cloud_are_composed_by_the_equations(cloud: PointCloud) -> None:
    picture = np.random.default_rng(3).integers(0, 256, (60, 80, 3), np.uint8)
    camera = Intrinsics(width=80, height=60, fx=60.0, fy=60.0, cx=40.0, cy=30.0)
    shrink = rectifier(camera, (40, 30))
    asked = ObservationManifest().on_robot(load_robot(find_manifest("robots", "spot")))
    asked = asked.model_copy(update={"points": SETTINGS})
    found = observe(picture, cloud, shrink, MOUNTED, asked, 5)
    assert np.array_equal(found.image, shrink.apply(picture))
    assert _bytes(found.points) == _bytes(observe_points(cloud, MOUNTED, SETTINGS, 5))
    seen = image_reliability(found.image, asked.image_reliability)
    felt = point_reliability(found.points.smoothness, asked.point_reliability)
    assert found.reliabilities == {**asdict(seen), **asdict(felt)}
    assert found.points.point_count < cloud.xyz.shape[0]
    assert found.reliabilities["r_planar"] > 0
