"""A scan as pointcloud_to_laserscan makes it, with half-open angles."""

import numpy as np
import pytest
from pydantic import ValidationError

from graspe_data.observation.laser_scan import LaserScanSettings, laser_scan

DEFAULT = LaserScanSettings()


def _scan(*points: tuple[float, float, float], base_height: float = 0.0) -> dict[int, float]:
    found = laser_scan(np.array(points, np.float32).reshape(-1, 3), base_height, DEFAULT)
    assert found.shape == (720,)
    assert found.dtype == np.float32
    return {int(ray): float(found[ray]) for ray in np.flatnonzero(np.isfinite(found))}


def test_empty_rays_are_infinite() -> None:
    assert _scan() == {}


def test_the_nearest_point_of_a_ray_wins_by_horizontal_range() -> None:
    assert _scan((5.0, 0.001, 0.2), (3.0, 0.001, 1.2), (4.0, 0.001, 0.5)) == {
        360: pytest.approx(3.0)
    }


def test_rays_run_from_right_to_left_and_the_last_angle_is_out() -> None:
    assert _scan((0.0, -2.0, 0.5)) == {0: 2.0}
    assert _scan((0.0, 2.0, 0.5)) == {}
    assert list(_scan((0.001, 2.0, 0.5))) == [719]
    assert _scan((-2.0, 0.1, 0.5)) == {}


@pytest.mark.parametrize(
    ("height", "distance", "counts"),
    [
        (0.15, 2, True),
        (0.14, 2, False),
        (1.2, 2, True),
        (1.21, 2, False),
        (0.5, 0.29, False),
        (0.5, 0.31, True),
        (0.5, 10.0, True),
        (0.5, 10.01, False),
    ],
)
def test_height_above_the_ground_and_range(height: float, distance: float, counts: bool) -> None:
    assert bool(_scan((distance, 0, height))) == counts
    lifted = (distance, 0, height - 0.5)
    assert bool(_scan(lifted, base_height=0.5)) == (counts or height in (0.15, 1.2))


def test_agrees_with_a_loop_over_the_points() -> None:
    rng = np.random.default_rng(8)
    xyz = rng.uniform((-6, -6, -0.5), (6, 6, 2), (4000, 3)).astype(np.float32)
    settings = LaserScanSettings(rays=90, half_angle=np.pi)
    expected = np.full(90, np.inf)
    for x, y, z in xyz.astype(np.float64):
        distance = np.hypot(x, y)
        if 0.15 <= z + 0.1 <= 1.2 and 0.3 <= distance <= 10:
            ray = int((np.arctan2(y, x) + np.pi) // (2 * np.pi / 90))
            expected[ray] = min(expected[ray], distance)
    assert laser_scan(xyz, 0.1, settings) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(
    ("limits", "fault"),
    [
        ({"minimum_height": 1.5}, r"minimum_height 1\.5 is above maximum_height 1\.2"),
        ({"minimum_range": 20.0}, r"minimum_range 20\.0 is above maximum_range 10\.0"),
    ],
)
def test_limits_the_wrong_way_round_are_refused(limits: dict[str, float], fault: str) -> None:
    with pytest.raises(ValidationError, match=fault):
        LaserScanSettings.model_validate(limits)
