"""What a recording says about its sensors puts what they saw where it stands."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from graspe_data.geometry import Transform
from graspe_data.recordings import open_recording
from graspe_data.recordings.decoding import (
    decode_calibration,
    decode_image,
    decode_motion,
    decode_points,
    decode_transforms,
)
from graspe_data.sensor_data import Motion, StampedTransform
from graspe_data.simulation.motion.drivers import Leg
from graspe_data.simulation.recording import record_drive
from graspe_data.synchronisation.transform_buffer import TransformBuffer
from tests.conftest import GardenDrive

PICTURE, CLOUD = "/camera/color/image_raw/compressed", "/velodyne_points"
ODOMETRY, CALIBRATION = "/spot/odometry", "/camera/color/camera_info"
HEIGHT, RIGHT, LEFT, FACE = 0.5, -0.5, 1.0, 3.9
LOW_WALL = {"kind": "wall", "lines": [[[4.0, RIGHT], [4.0, LEFT]]], "height": [HEIGHT, HEIGHT]}
NO_ERRORS = {"scale": 0.0, "speed_noise": 0.0, "yaw_rate_noise": 0.0, "yaw_walk": 0.0}


class Told:
    """A recording of a drive towards a low wall on soil, decoded, by topic."""

    def __init__(self, path: Path) -> None:
        self.by_topic: dict[str, list[Any]] = {}
        with open_recording(path) as recording:
            self.types = {name: info.message_type for name, info in recording.topics.items()}
            for raw in recording.messages():
                self.by_topic.setdefault(raw.topic, []).append(recording.decode(raw))

    def sensor_at(self, stamp_ns: int, frame: str) -> Transform:
        """A sensor's frame in the world, by the odometry and the mounting."""
        said = (
            decode_motion(each, self.types[ODOMETRY], ODOMETRY) for each in self.by_topic[ODOMETRY]
        )
        motion: Motion = next(each for each in said if each.stamp_ns == stamp_ns)
        base = Transform.from_quaternion(np.array(motion.position), np.array(motion.quaternion))
        edges = {
            (edge.parent, edge.child): _transform(edge)
            for edge in decode_transforms(self.by_topic["/tf_static"][0])
        }
        return base @ TransformBuffer.of_fixed(edges).lookup("base_link", frame, 0)


def _transform(edge: StampedTransform) -> Transform:
    return Transform.from_quaternion(np.array(edge.translation), np.array(edge.quaternion))


@pytest.fixture(scope="module")
def told(garden_drive: GardenDrive, tmp_path_factory: pytest.TempPathFactory) -> Told:
    driven = garden_drive(
        (Leg(1.0, 0.6, 0.3),),
        world={"ground": {"cover": "soil", "amplitude": 0.0}, "features": [LOW_WALL]},
        camera={"width": 320, "height": 240, "rate": 2.0},
        lidar={"rate": 2.0, "rotation_rate": 10.0, "motion_distortion": False},
        motion={"odometry": NO_ERRORS, "slip": {"mean": 0.0, "spread": 0.0}},
    )
    path = tmp_path_factory.mktemp("geometry") / "drive"
    record_drive(driven, path, "mcap")
    return Told(path)


def wall_pixels(rgb: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Grey pixels; the soil is redder than blue."""
    return rgb[..., 2].astype(np.float64) > 0.8 * rgb[..., 0]


def test_known_points_are_seen_at_their_pixels(told: Told) -> None:
    camera_info = decode_calibration(told.by_topic[CALIBRATION][0], CALIBRATION).intrinsics
    for said in told.by_topic[PICTURE]:
        picture = decode_image(said, told.types[PICTURE], PICTURE)
        camera = told.sensor_at(picture.stamp_ns, picture.frame)

        def pixel(y: float, z: float, camera: Transform = camera) -> tuple[int, int]:
            seen = camera_info.matrix @ camera.inverse().apply(np.array([FACE, y, z]))
            u, v = np.round(seen[:2] / seen[2]).astype(int).tolist()
            return u, v

        wall = wall_pixels(picture.rgb)
        for y, outward in ((RIGHT, 1), (LEFT, -1)):
            u, v = pixel(y, HEIGHT / 2)
            assert wall[v - 3 : v + 4, u - 4 * outward].mean() > 0.8
            assert wall[v - 3 : v + 4, u + 6 * outward].mean() < 0.2
        for z, outward in ((HEIGHT, -1), (0.0, 1)):
            u, v = pixel((RIGHT + LEFT) / 2, z)
            assert wall[v - 4 * outward, u - 10 : u + 11].mean() > 0.8
            assert wall[v + 6 * outward, u - 10 : u + 11].mean() < 0.2


def test_clouds_put_the_wall_and_the_ground_where_they_are(told: Told) -> None:
    for said in told.by_topic[CLOUD]:
        cloud = decode_points(said, CLOUD)
        lidar = told.sensor_at(cloud.stamp_ns, cloud.frame)
        x, y, z = lidar.apply(cloud.xyz.astype(np.float64)).T
        wall = (z > 0.05) & (np.abs(x - FACE) < 0.3)
        assert wall.sum() > 50
        assert np.median(x[wall]) == pytest.approx(FACE, abs=0.01)
        assert y[wall].min() == pytest.approx(RIGHT, abs=0.1)
        assert y[wall].max() == pytest.approx(LEFT, abs=0.1)
        assert z[wall].max() < HEIGHT + 0.02
        ground = np.hypot(x, y) < 3.5
        assert ground.sum() > 1000
        assert z[ground].mean() == pytest.approx(0.0, abs=0.005)


def test_the_lasers_lie_at_the_angles_of_a_vlp_16(told: Told) -> None:
    for said in told.by_topic[CLOUD]:
        cloud = decode_points(said, CLOUD)
        assert cloud.ring is not None
        x, y, z = cloud.xyz.astype(np.float64).T
        elevation = np.degrees(np.arctan2(z, np.hypot(x, y)))
        np.testing.assert_allclose(elevation, 2.0 * cloud.ring - 15.0, atol=1e-3)
